"""The reference motion: square roots of matrices and the mass, damper and spring, held against SciPy."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm, sqrtm

from baselines.estimation import admittance
from baselines.estimation.admittance import DAMPING_RATIO, Compliance, square_root
from birthsim_env.loop.signals import REFERENCES, Motion, Point, Reference
from birthsim_env.physics.compiled.lanes import Array

MASS, PERIOD = 3.0, 1e-3
COUPLED = np.array([[3000.0, 800.0], [800.0, 1500.0]])


def springs(count: int, seed: int = 0) -> Array:
    """Symmetric positive definite matrices (count, 2, 2), N/m, with eigenvalues from 300 to 6000 and any axes."""
    rng = np.random.default_rng(seed)
    turn, values = rng.uniform(0, np.pi, count), np.exp(rng.uniform(np.log(300), np.log(6000), (count, 2)))
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]).transpose(2, 0, 1)
    return np.asarray(axes * values[:, None] @ axes.transpose(0, 2, 1))


def asked(position: Array, stiffness: Array) -> Reference:
    """A resting target (2, N) with stiffness matrices (N, 2, 2)."""
    rows = np.zeros((REFERENCES, position.shape[1]))
    rows[:2], rows[8], rows[9], rows[14] = position, stiffness[:, 0, 0], stiffness[:, 1, 1], stiffness[:, 0, 1]
    return Reference(rows)


class Follower:
    """The kernels with the offset that a stage keeps for them, over N lanes."""

    def __init__(self, lanes: int = 1, ratio: float = DAMPING_RATIO, period: float = PERIOD, mass: float = MASS) -> None:
        self.offset = Point(np.zeros((Point.size, lanes)))
        self._about = Compliance(Compliance.numbers(mass=mass, damping_ratio=ratio, period=period))

    def update(self, force: Array, reference: Reference, factor: Array | None = None, heavier: Array | None = None) -> Array:
        lanes = force.shape[1]
        heavier = np.ones(lanes) if heavier is None else heavier
        motion, factor = Motion(np.empty((Motion.size, lanes))), np.zeros(lanes) if factor is None else factor
        assert admittance.update_motion(self.offset, reference, force, self._about, factor, heavier, motion) == 0
        return motion.rows

    def forecast(self, reference: Reference, force: Array, ticks: Array) -> Array:
        offset = Point(self.offset.rows.copy())
        ahead = np.empty((4 * len(ticks), force.shape[1]))
        admittance.forecast(offset, reference, force, self._about, ticks.astype(float), ahead)
        return ahead.reshape(len(ticks), 4, -1)


def generator(stiffness: Array, mass: float = MASS, ratio: float = DAMPING_RATIO) -> tuple[Array, Array]:
    """A (4, 4) and B (4, 2) of d/dt (x, v) = A (x, v) + B F, with the damping 2 ratio (m K)^(1/2)."""
    damping = 2 * ratio * np.real(sqrtm(mass * stiffness))
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness / mass, -damping / mass]])
    return a, np.vstack([np.zeros((2, 2)), np.eye(2) / mass])


def exact_motion(force: Callable[[int], Array], plan: list[Array], ticks: int, *about: float) -> Array:
    """Offset, speed, acceleration and jerk (ticks, 8) of one lane under a force that is held for every period: by expm.

    Each stiffness of the plan holds for an equal fraction of the ticks; ``about`` are mass, kg, and damping ratio.
    """
    state, motion, fraction = np.zeros(4), np.empty((ticks, 8)), ticks // len(plan)
    for tick in range(ticks):
        if tick % fraction == 0:
            a, b = generator(plan[tick // fraction], *about)
            held = expm(PERIOD * np.block([[a, b], [np.zeros((2, 6))]]))
        push = force(tick)
        first = a @ state + b @ push
        motion[tick] = np.concatenate([state, first[2:], (a @ first)[2:]])
        state = held[:4, :4] @ state + held[:4, 4:] @ push
    return motion


def test_square_root_of_matrices() -> None:
    matrices = np.concatenate([springs(200), [np.eye(2), COUPLED, np.diag([1.0, 5000.0])]])
    for matrix in matrices:
        xx, yy, xy = square_root(matrix[0, 0], matrix[1, 1], matrix[0, 1])
        expected = sqrtm(matrix)
        np.testing.assert_allclose([[xx, xy], [xy, yy]], expected, rtol=0, atol=1e-12 * np.linalg.norm(expected))


@pytest.mark.parametrize(("mass", "ratio"), [(MASS, DAMPING_RATIO), (5.0, 0.3), (5.0, 1.0)])
def test_motion_is_that_of_mass_damper_and_spring(mass: float, ratio: float) -> None:
    """Forces that change and stiffness matrices that are exchanged half-way, which moves nothing at once: a lane for each."""
    ticks, matrices = 400, np.concatenate([springs(7), [COUPLED]])
    rng = np.random.default_rng(1)
    levels = rng.uniform(-40, 40, (20, 2, len(matrices)))
    place, plan = np.full((2, len(matrices)), 0.1), (matrices, matrices[::-1])
    model, references = Follower(len(matrices), ratio, mass=mass), [asked(place, springs) for springs in plan]
    got = np.array([model.update(levels[tick // 20], references[tick // 200]) for tick in range(ticks)])
    got[:, :2] -= 0.1
    for lane in range(len(matrices)):

        def force(tick: int, lane: int = lane) -> Array:
            return np.asarray(levels[tick // 20, :, lane])

        expected = exact_motion(force, [springs[lane] for springs in plan], ticks, mass, ratio)
        for row in range(0, 8, 2):
            size = np.abs(expected[:, row : row + 2]).max()
            np.testing.assert_allclose(got[:, row : row + 2, lane], expected[:, row : row + 2], rtol=0, atol=1e-5 * size)


def test_a_moving_target_carries_the_motion_along() -> None:
    """m (xr'' - xt'') + B (xr' - xt') + K (xr - xt) = F in absolute coordinates, integrated by SciPy along a circle."""
    rate, radius, force = 5.0, 0.05, np.array([12.0, -25.0])
    a, b = generator(COUPLED)

    def target(time: float) -> Array:
        """x, y and three derivatives, (4, 2)."""
        angle = rate * time + np.pi / 2 * np.arange(4)
        return np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius * rate ** np.arange(4)[:, None]

    def slope(time: float, state: Array) -> Array:
        at = target(time)
        off = state - np.concatenate([at[0], at[1]])
        return np.concatenate([state[2:], at[2] + (a @ off + b @ force)[2:]])

    times = PERIOD * np.arange(800)
    start = np.concatenate([target(0)[0], target(0)[1]])
    truth = solve_ivp(slope, (0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-13).y.T
    model, got = Follower(), []
    for time in times:
        reference = asked(np.zeros((2, 1)), COUPLED[None])
        reference.rows[:8, 0] = target(time).ravel()
        got.append(model.update(force[:, None], reference)[:, 0])
    motion = np.array(got)
    np.testing.assert_allclose(motion[:, :2], truth[:, :2], rtol=0, atol=1e-7)
    np.testing.assert_allclose(motion[:, 2:4], truth[:, 2:], rtol=0, atol=5e-6)
    accelerations = np.array([slope(time, state)[2:] for time, state in zip(times, truth, strict=True)])
    np.testing.assert_allclose(motion[:, 4:6], accelerations, rtol=0, atol=2e-4)
    # With a force that stays, row by row the derivative of the one above: central differences are exact to period^2.
    for row in (0, 2, 4):
        slopes = (motion[2:, row : row + 2] - motion[:-2, row : row + 2]) / (2 * PERIOD)
        size = np.abs(motion[:, row + 2 : row + 4]).max()
        np.testing.assert_allclose(slopes, motion[1:-1, row + 2 : row + 4], rtol=0, atol=1e-3 * size)


def test_a_damping_factor_multiplies_the_damping_of_each_lane() -> None:
    """Lane by lane the motion of an admittance with that much more damping, bit for bit; below 1 it says nothing."""
    factors, force = np.array([0.0, 1.0, 1.5, 2.0]), np.full((2, 4), 20.0)
    reference = asked(np.zeros((2, 4)), np.repeat([COUPLED], 4, axis=0))
    model = Follower(4, 0.8)
    plain = [Follower(ratio=0.8 * max(1.0, factor)) for factor in factors]
    for _ in range(300):
        motion = model.update(force, reference, factors)
        for lane, one in enumerate(plain):
            alone = Reference(reference.rows[:, lane : lane + 1])
            assert np.array_equal(motion[:, lane : lane + 1], one.update(force[:, :1], alone))


@pytest.mark.parametrize("period", [1e-3, 1e-2])
def test_a_forecast_comes_true_where_nothing_new_happens(period: float) -> None:
    """What ``update`` says later in every lane, one just reset, where force and stiffness stay; asking changes nothing."""
    rng, lanes = np.random.default_rng(5), 4
    matrices, ticks = np.concatenate([springs(lanes - 1), [COUPLED]]), np.array([1, 2, 3, 7, 8, 20, 57])
    target = rng.uniform(-1, 1, (4, 2, lanes)) * np.array([0.5, 0.3, 2.0, 40.0])[:, None, None]

    def at(tick: int) -> Reference:
        """Position and three derivatives after so many periods of constant jerk."""
        time, reference = tick * period, asked(np.zeros((2, lanes)), matrices)
        for order in range(4):
            terms = [target[k] * time ** (k - order) / math.factorial(k - order) for k in range(order, 4)]
            reference.rows[2 * order : 2 * order + 2] = np.sum(terms, axis=0)
        return reference

    model, kept = Follower(lanes, period=period), Follower(lanes, period=period)
    for tick in range(-60, 1):
        force = rng.uniform(-30, 30, (2, lanes))
        if tick == 0:
            model.offset.rows[:, 1] = kept.offset.rows[:, 1] = 0.0
        motion = model.update(force, at(tick))
        kept.update(force, at(tick))
    ahead = model.forecast(at(0), force, ticks)
    assert ahead.shape == (len(ticks), 4, lanes)
    np.testing.assert_array_equal(model.forecast(at(0), force, ticks[2:]), ahead[2:])
    for tick in range(1, ticks[-1] + 1):
        motion = model.update(force, at(tick))
        assert np.array_equal(motion, kept.update(force, at(tick)))
        for found in ahead[ticks == tick]:
            np.testing.assert_allclose(found, motion[:4], rtol=1e-11, atol=1e-13)


def test_a_heavier_motion_is_that_of_the_heavier_mass() -> None:
    """Lane by lane, against an exact solution whose mass is multiplied."""
    factors, ticks = np.array([1.0, 2.5, 10.0]), 300
    model, reference = Follower(len(factors)), asked(np.zeros((2, len(factors))), np.stack([COUPLED] * len(factors)))

    def force(tick: int) -> Array:
        return np.array([20.0 * (tick > 50), -8.0 * (tick > 120)])

    got = np.stack([model.update(np.stack([force(k)] * len(factors), axis=1), reference, None, factors) for k in range(ticks)])
    for lane, factor in enumerate(factors):
        expected = exact_motion(force, [COUPLED], ticks, factor * MASS, DAMPING_RATIO)
        np.testing.assert_allclose(got[:, :4, lane], expected[:, :4], atol=1e-6)
