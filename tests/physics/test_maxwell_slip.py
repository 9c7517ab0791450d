"""Generalised Maxwell slip: against the second model, no drift, memory of reversals, lag, energy, and lanes among others."""

import itertools

import numpy as np
import pytest

from birthsim_env.physics import dynamics, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.seals.driven_friction import friction_along
from birthsim_env.physics.seals.maxwell_slip import ELEMENTS, MOVING, REACH, STIFFNESS
from lab.studies.accuracy.motions import PERIOD, PERIODS, Motion, stick_slip, strong
from lab.studies.accuracy.second_model import SecondModel
from tests.physics.rigs import OTHER, PRESSED

GMS = {"friction.law": "gms"}
RIG = Parameters().replace(GMS)
S0, S1, FC, FV = RIG.friction.bristle_stiffness, RIG.friction.bristle_damping, 11.7, 35.0
FS = FC * RIG.friction.static_ratio


def along(path: Array, period: float, changes: dict[str, object] | None = None) -> Array:
    """Friction of piston 2 less what is viscous, N, along positions ``path`` (T,) every ``period`` s, between chambers at the
    atmosphere's pressure; speeds are those that end at the positions."""
    rig = RIG.replace({"cylinder2.viscous_friction": 0.0, "friction.bristle_damping": 0.0, **(changes or {})})
    times = period * np.arange(len(path))
    # A speed that is a straight line between samples has the mean of both ends.
    speed = np.zeros(len(path))
    for k in range(1, len(path)):
        speed[k] = 2 * (path[k] - path[k - 1]) / period - speed[k - 1]
    return friction_along(rig, 2, times, speed, np.full((2, len(path)), rig.air.atmospheric_pressure))


def turning(corners: list[float], speed: float = 1e-4, period: float = 1e-3) -> tuple[Array, list[int]]:
    """A path through ``corners``, m, that begins and ends each way smoothly, and the samples at the corners."""
    path, marks = [np.array([corners[0]])], [0]
    for a, b in itertools.pairwise(corners):
        count = max(round(abs(b - a) / speed / period), 10)
        share = np.arange(1, count + 1) / count
        path.append(a + (b - a) * share * share * (3 - 2 * share))
        marks.append(marks[-1] + count)
    return np.concatenate(path), marks


def test_shares_make_the_stiffness_of_a_reversal_and_the_level_of_sliding() -> None:
    assert sum(STIFFNESS) == pytest.approx(1.0, rel=1e-15)
    assert np.dot(STIFFNESS, REACH) == pytest.approx(1.0, rel=1e-15)
    bent = np.linspace(0, 8, 801)
    first = np.minimum(bent, np.array(REACH)[:, None]).T @ STIFFNESS
    assert np.abs(first - (1 - np.exp(-bent))).max() < 0.03, "the first loading is LuGre's, z' = v (1 - s0 z/G)"


CASES: dict[str, tuple[dict[str, object], Motion, tuple[float, float]]] = {
    # Position (m) and pressure (relative), about twice what was measured: every element's corner costs, as (4)'s do.
    "default, stick-slip": ({}, stick_slip, (2.4e-6, 1e-5)),
    "default, strong": ({}, strong, (1.1e-5, 3.6e-5)),
    "pressed seals, strong": (PRESSED, strong, (1.4e-5, 8.5e-5)),
    "other rig, stick-slip": (OTHER, stick_slip, (1.7e-6, 9e-6)),
}


@pytest.mark.parametrize("name", CASES)
def test_a_plant_moves_as_the_second_model_and_nearer_with_finer_steps(name: str) -> None:
    changes, motion, allowed = CASES[name]
    rig = Parameters().replace({**changes, **GMS})
    coarse, fine = Plant(rig), Plant(rig)
    model = SecondModel(rig, coarse.end_effector()[:, 0], coarse.state[:, 0])
    worst, finer, spread = np.zeros(2), np.zeros(2), 0.0
    for k in range(PERIODS):
        command, push = motion(k)
        model.advance(command, push, PERIOD)
        coarse.advance(command[:, None], push[:, None], PERIOD)
        steps = 16 * round(PERIOD / dynamics.INTEGRATION_STEP)
        how = command[:, None].copy(), push[None, :, None].copy(), fine.lane_parameters, steps, PERIOD / steps, fine.impacts
        options.advance(fine.state, fine.memory[4:], *how)
        for plant, found in ((coarse, worst), (fine, finer)):
            position = np.abs(plant.end_effector()[:2, 0] - model.state[:2]).max()
            found[:] = np.maximum(found, [position, np.abs(plant.pressures[:, 0] / model.pressures - 1).max()])
        bent = fine.memory[4 + options.BRISTLES : 4 + options.BRISTLES + MOVING, 0]
        np.testing.assert_allclose(bent * S0 * np.tile(STIFFNESS, 2), model.state[18:], atol=0.01)
        spread = max(spread, float(np.ptp(bent[:ELEMENTS])))
    assert np.all(worst < allowed), worst
    assert np.all(finer < worst / 5), (worst, finer)
    assert spread > 1e-4, "elements slip one by one"


def test_a_closed_loop_closes_in_the_force_and_what_came_before_does_not_matter() -> None:
    """Return-point memory: a branch that comes back to where it turned is as if it had not turned."""
    path, marks = turning([0.0, 2e-4, 0.5e-4, 1.5e-4, 0.5e-4, 2e-4, 3e-4])
    force = along(path, 1e-3)
    straight = along(turning([0.0, 2e-4, 3e-4])[0], 1e-3)
    assert force[marks[1]] == pytest.approx(force[marks[5]], abs=1e-6)
    assert force[marks[2]] == pytest.approx(force[marks[4]], abs=1e-6)
    assert force[-1] == pytest.approx(straight[-1], abs=1e-6)
    assert force[marks[1]] - force[marks[3]] > 1.0, "the loop is one"


def test_a_branch_after_a_reversal_is_the_first_loading_twice_as_large() -> None:
    """Masing's rule: F = F_r - 2 f((y_r - y)/2) with the first loading f."""
    top = 4e-4
    path, marks = turning([0.0, top, -top])
    force = along(path, 1e-3)
    first, back = slice(0, marks[1] + 1), slice(marks[1], None)
    twice = force[marks[1]] - 2 * np.interp((top - path[back]) / 2, path[first], force[first])
    np.testing.assert_allclose(force[back], twice, atol=2e-3)
    # The first loading has the corners of the elements: slopes fall by their shares.
    corners = np.array(REACH) * FS / S0
    expected = S0 * (np.minimum(path[first], corners[:, None]).T @ STIFFNESS)
    np.testing.assert_allclose(force[first], expected, atol=2e-3)


def test_a_piston_under_a_load_that_trembles_rests_where_lugre_drifts() -> None:
    """6 N with 5 N at 5 Hz on it, below break-away."""
    free = {"mechanics.gravity": 0.0, "chambers.dead_volume": 10.0, "valves.leakage_ratio": 0.0}
    push, moved = np.zeros((16000, 2, 1)), {}
    push[:, 0, 0] = 6 + 5 * np.sin(2 * np.pi * 5 * (np.arange(16000) + 0.5) * 2.5e-4)
    for law in ("gms", "lugre"):
        plant = Plant(Parameters().replace({**free, "friction.law": law}))
        plant.state[list(at.PRESSURES)] = Parameters().air.atmospheric_pressure
        ends = []
        for half in np.split(push, 2):
            plant.advance(np.zeros((4, 1)), half, 2.0)
            ends.append(plant.state[at.Y2, 0])
        moved[law] = ends[1] - ends[0]
    assert abs(moved["gms"]) < 1e-9
    assert moved["lugre"] > 1e-5


@pytest.mark.parametrize("attraction", [200.0, 5000.0])
def test_friction_of_a_sliding_piston_lags_behind_its_level(attraction: float) -> None:
    """After a sudden brake F goes to the new level as exp(-C t/G), but not faster than the piston bends the elements."""
    rig = RIG.replace({"friction.attraction": attraction, "cylinder2.viscous_friction": 0.0, "friction.bristle_damping": 0.0})
    fast, slow = 0.3, 0.05
    times = np.arange(0, 0.4, 5e-4)
    speed = np.where(times < 0.2, fast, slow)
    force = friction_along(rig, 2, times, speed, np.full((2, len(times)), rig.air.atmospheric_pressure))

    def level(v: float) -> float:
        return FC * (1 + 0.33 / (1 + (v / 0.015) ** 2))

    before, after = times < 0.199, times > 0.2
    np.testing.assert_allclose(force[before][200:], level(fast), rtol=1e-6)
    rate = attraction / level(slow)
    assert rate * (level(slow) - level(fast)) < S0 * STIFFNESS[-1] * slow, "the elements could bend faster"
    expected = level(slow) + (level(fast) - level(slow)) * np.exp(-rate * (times[after] - 0.2))
    np.testing.assert_allclose(force[after], expected, atol=0.01)


@pytest.mark.parametrize("amplitude", [1e-5, 1e-4, 1e-3, 1e-2])
def test_friction_takes_energy_and_gives_back_no_more_than_bristles_hold(amplitude: float) -> None:
    """Whenever: work done on it less what is dissipated is that of springs, sum c_i s0 z_i^2/2, at most."""
    rng, period = np.random.default_rng(0), 1e-4
    phase = rng.uniform(0, 2 * np.pi, 3)
    times = period * np.arange(20000)
    path = amplitude * sum(np.sin(2 * np.pi * f * times + one) for f, one in zip((1.3, 2.1, 4.7), phase, strict=True))
    speed = np.gradient(path, period)
    rig = RIG.replace({"cylinder2.viscous_friction": 0.0})
    force = friction_along(rig, 2, times, speed, np.full((2, len(times)), rig.air.atmospheric_pressure))
    work = np.concatenate([[0.0], np.cumsum(0.5 * period * (force[1:] * speed[1:] + force[:-1] * speed[:-1]))])
    most = 0.5 * S0 * np.dot(STIFFNESS, np.square(np.multiply(REACH, FS / S0)))
    # No later than at any instant may more come back than the springs can hold then; sums of trapezoids err by 1 %.
    held = np.minimum(most, 0.5 * S0 * (2 * np.maximum.accumulate(np.abs(path - path[0]))) ** 2)
    assert np.all(np.maximum.accumulate(work) - work <= held + 0.01 * work.max() + 1e-12)
    assert work[-1] > 0


def test_a_start_in_motion_slips_steadily_and_one_at_rest_is_loaded_from_rest() -> None:
    plant = Plant(RIG, 3)
    plant.state = balanced_state(plant.lane_parameters, np.zeros((2, 3)), np.array([[0.1, -0.002, 0.0]] * 2))
    bent = plant.memory[4 + options.BRISTLES : 4 + options.BRISTLES + MOVING].reshape(2, ELEMENTS, 3)
    ways = plant.memory[4 + options.BRISTLES + MOVING :].reshape(2, ELEMENTS, 3)
    np.testing.assert_allclose(np.einsum("e,cel->cl", STIFFNESS, bent), plant.state[[at.Z1, at.Z2]], rtol=1e-12)
    np.testing.assert_array_equal(bent[:, :, 2], 0.0)
    for lane, sign in ((0, 1.0), (1, -1.0)):
        np.testing.assert_allclose(bent[:, :, lane] / bent[:, :1, lane], np.tile(np.array(REACH) / REACH[0], (2, 1)))
        assert set(np.unique(ways[:, :, lane])) <= {0.0, sign}
    state = plant.state.copy()
    state[[at.V1, at.V2]], state[[at.Z1, at.Z2]] = 0.0, 0.5 * FS / S0
    plant.state = state
    bent = plant.memory[4 + options.BRISTLES : 4 + options.BRISTLES + MOVING].reshape(2, ELEMENTS, 3)
    np.testing.assert_allclose(np.einsum("e,cel->cl", STIFFNESS, bent), 0.5 * FS / S0, rtol=1e-12)
    assert np.all(np.diff(bent, axis=1) >= 0)


def test_lanes_without_it_keep_their_bits_and_a_lane_alone_has_those_of_one_among_many() -> None:
    laws = ["gms", "lugre", "coulomb", "gms"]
    rigs = [Parameters().replace({**PRESSED, "friction.law": law}) for law in laws]
    together, alone = Plant(rigs, 4), [Plant(rig) for rig in rigs]
    rng = np.random.default_rng(1)
    for _ in range(30):
        command, push = rng.uniform(-0.4, 0.4, (4, 1)), rng.uniform(-60, 60, (2, 1))
        for plant in (together, *alone):
            plant.advance(np.repeat(command, plant.num_envs, 1), np.repeat(push, plant.num_envs, 1), 0.01)
    for lane, plant in enumerate(alone):
        np.testing.assert_array_equal(together.state[:, lane], plant.state[:, 0])
    assert not np.array_equal(together.state[:, 0], together.state[:, 1])
    assert np.all(together.memory[4 + options.BRISTLES :, 1:3] == 0)


def test_its_gradients_are_refused() -> None:
    plant = Plant(RIG)
    with pytest.raises(ValueError, match=r"friction\.law.*allowed"):
        plant.vjp(np.zeros((4, 1)), np.zeros((2, 1)), 0.01)


@pytest.mark.parametrize(
    ("name", "given", "allowed"),
    [
        ("cylinder", {"cylinder": 3}, "1 or 2"),
        ("times", {"times": [0.0, 1.0, 1.0]}, "later than"),
        ("times", {"times": []}, "at least one"),
        ("speed", {"speed": [0.0]}, r"\(3,\)"),
        ("pressures", {"pressures": np.zeros((3, 2))}, r"\(2, 3\)"),
    ],
)
def test_a_motion_that_cannot_be_is_refused(name: str, given: dict[str, object], allowed: str) -> None:
    motion = {"cylinder": 2, "times": [0.0, 1.0, 2.0], "speed": np.zeros(3), "pressures": np.zeros((2, 3)), **given}
    with pytest.raises(ValueError, match=rf"{name}.*allowed: .*{allowed}"):
        friction_along(None, **motion)  # type: ignore[arg-type]
