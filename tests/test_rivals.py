"""PID, LQR and sliding mode: each law against formulas derived anew, its motion on the control model, and on the plant."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from baselines import BacksteppingController
from baselines.registry import make_controller
from baselines.rivals import LinearQuadratic, PositionPID, SlidingMode, lqr, pid
from baselines.rivals.feedforward import NEEDED, SIGN_WIDTH, prepare
from baselines.rivals.follower import Follower, beyond
from birthsim_env import geometry
from birthsim_env.lanes import Array, parameter_column
from birthsim_env.parameters import Parameters
from birthsim_env.sensors import LabSensors
from birthsim_env.signals import Measurement, Reference
from tests import closed_loop
from tests import derived_law as derived
from tests.closed_loop import FRICTIONLESS

RIVALS = (PositionPID, LinearQuadratic, SlidingMode)
PERIOD = 1e-3
TILTED = Parameters().replace(
    {
        "geometry.gamma3": 1.2, "geometry.d3": 0.42, "geometry.d6": 0.21, "geometry.k1": 0.45, "mechanics.mass": 4.2,
        "cylinder1.viscous_friction": 55.0, "cylinder2.coulomb_friction": 22.0, "cylinder2.rod_diameter": 0.012,
    }
)  # fmt: skip
every_rival = pytest.mark.parametrize("rival", RIVALS, ids=lambda kind: kind.__name__)


def prepared(joints: Array, force: Array, rig: Parameters, share: float, force_rate: Array | float = 0.0) -> Array:
    """``needed`` of ``prepare`` for a motion of the joints (8, N), whose jerk lacks the user's ``force_rate`` / m."""
    motion = derived.cartesian(joints, rig).rows[:8].copy()
    motion[6:8] -= force_rate / rig.mechanics.mass
    lanes = joints.shape[1]
    out = np.empty((4, lanes)), np.empty((8, lanes)), np.empty((NEEDED, lanes))
    prepare(motion[:4].copy(), False, motion, force, parameter_column(rig), share, *out)
    np.testing.assert_allclose(out[0], joints[:4], atol=1e-12)
    np.testing.assert_allclose(out[1][:6], joints[:6], atol=1e-10)
    return out[2]


@pytest.mark.parametrize("rig", [Parameters(), TILTED], ids=["default", "tilted"])
def test_the_needed_force_gives_the_wanted_acceleration(rig: Parameters) -> None:
    """(5), derived in SymPy, with the smoothed friction of the reference and the user's force added by (17)."""
    rng, lanes, share = np.random.default_rng(1), 50, 0.6
    joints = rng.normal(0, 1, (8, lanes)) * np.repeat([0.03, 0.1, 1.0, 10.0], 2)[:, None]
    force = rng.normal(0, 30, (2, lanes))
    needed = prepared(joints, force, rig, share)
    believed = {f"{c}.coulomb_friction": share * getattr(rig, c).coulomb_friction for c in ("cylinder1", "cylinder2")}
    acceleration = derived.accelerations(rig.replace(believed), SIGN_WIDTH, True)
    along = geometry.joint_force(force, joints[:2], rig)
    np.testing.assert_allclose(acceleration(*joints[:4], *(needed[:2] + along)), joints[4:6], atol=1e-9)
    columns = geometry.jacobian(joints[:2], rig)
    np.testing.assert_allclose(needed[4], np.hypot(*columns[:, 0]), rtol=1e-12)


def test_the_rate_of_the_needed_force_is_its_derivative() -> None:
    """Along sinusoids of the joints, under a user's force that changes: its rate cancels against what the jerk leaves out."""
    rig, rates, step = TILTED, np.array([[3.0], [2.5]]), 1e-5

    def joints(t: Array) -> Array:
        swing = np.array([[0.04], [0.06]])
        return np.concatenate([swing * rates**k * np.sin(rates * t + k * np.pi / 2 + 0.4) for k in range(4)])

    def force(t: Array) -> Array:
        return np.array([20 * np.sin(7 * t), 15 * np.cos(5 * t)])

    t = np.linspace(0, 3, 40)
    force_rate = np.array([140 * np.cos(7 * t), -75 * np.sin(5 * t)])
    needed = prepared(joints(t), force(t), rig, 0.7, force_rate)
    ahead, behind = (prepared(joints(t + s), force(t + s), rig, 0.7)[:2] for s in (step, -step))
    np.testing.assert_allclose(needed[2:4], (ahead - behind) / (2 * step), rtol=1e-4, atol=0.02)


# PID


def test_pressure_setpoints_give_force_and_pneumatic_stiffness() -> None:
    """(9) and F = Pp Sp - Pn Sn, where the supply can; else the force, with the nearest pressures that can be."""
    rng, cylinder, rig = np.random.default_rng(2), Parameters().cylinder1, Parameters()
    (ap, an), low, high = derived.areas(cylinder), rig.air.atmospheric_pressure, rig.air.supply_pressure
    y, stiffness = rng.uniform(-0.08, 0.08, 400), rng.uniform(1500, 6500, 400)
    force = rng.uniform(low * ap - high * an, high * ap - low * an, 400)
    both = [
        pid.pressure_setpoints.py_func(f, k, ap, an, 0.1 + at, 0.1 - at, rig.air.polytropic_index, low, high)
        for f, k, at in zip(force, stiffness, y, strict=True)
    ]
    set_p, set_n = np.array(both).T
    np.testing.assert_allclose(set_p * ap - set_n * an, force, atol=1e-9)
    assert min(set_p.min(), set_n.min()) > low * (1 - 1e-12)
    assert max(set_p.max(), set_n.max()) < high * (1 + 1e-12)
    wished = derived.pressures_for(force, stiffness, y, cylinder, rig)
    inside = np.all((wished > low) & (wished < high), axis=0)
    assert 50 < inside.sum() < 350
    np.testing.assert_allclose(np.array([set_p, set_n])[:, inside], wished[:, inside], rtol=1e-12)
    limited = np.isclose([set_p, set_n], low, rtol=1e-9) | np.isclose([set_p, set_n], high, rtol=1e-9)
    assert np.all(limited.any(axis=0)[~inside])


def test_pid_openings_step_by_step() -> None:
    """First call: the integral takes what the chambers hold beyond F*. Second: it has grown by the error beyond the zone."""
    rig, gains = TILTED, {"bandwidth": 30.0, "damping": 0.8, "integral_rate": 4.0, "pressure_gain": 90.0}
    law = PositionPID(rig, **gains, friction_share=0.5, dead_zone=3e-4)
    wanted = np.array([0.01, -0.04, 0, 0, 0, 0, 0, 0.0])[:, None]
    reference = derived.cartesian(wanted, rig)
    reference.rows[8:10], reference.rows[10:12] = 2000.0, closed_loop.PNEUMATIC_STIFFNESS
    error, error_rate = np.array([2e-4, -1.5e-4]), np.array([0.002, -0.003])
    piston, speed = wanted[:2, 0] - error, -error_rate
    needed = prepared(wanted, np.zeros((2, 1)), rig, 0.5)[:, 0]
    pressures = np.concatenate(
        [
            derived.pressures_for(needed[i] + 4.0, 1.01 * closed_loop.PNEUMATIC_STIFFNESS[i, 0], piston[i], cylinder, rig)
            for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2))
        ]
    )
    measured = derived.seen(piston[:, None], speed[:, None], pressures[:, None], rig)
    held = np.array(derived.forces(pressures, rig)) - needed[:2]
    scale = np.array([needed[4], 1.0])
    spring = rig.mechanics.mass * scale**2 * 30.0**2
    for calls in range(3):
        openings = law.command(measured, reference)[:, 0]
        outside = error - np.clip(error, -3e-4 / scale, 3e-4 / scale)
        assert outside[0] > 0
        assert outside[1] == 0
        summed = held + calls * PERIOD * spring * 4.0 * outside
        force = needed[:2] + spring * (error + 2 * 0.8 / 30.0 * error_rate) + summed
        expected = []
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
            goal = derived.pressures_for(force[i], closed_loop.PNEUMATIC_STIFFNESS[i, 0], piston[i], cylinder, rig)
            air = pressures[2 * i : 2 * i + 2]
            still = np.array(derived.chamber_rates(air, (0.0, 0.0), piston[i], speed[i], cylinder, rig))
            unit = np.array(derived.chamber_rates(air, (1.0, 1.0), piston[i], speed[i], cylinder, rig)) - still
            flows = (90.0 * (goal - air) - still) / unit
            expected += [derived.opening_for(q, p, rig) for q, p in zip(flows, air, strict=True)]
        assert np.abs(expected).max() < 1
        np.testing.assert_allclose(openings, expected, atol=1e-9)


# LQR


@pytest.mark.parametrize("scale", [1.0, 2.3])
def test_the_regulator_solves_the_riccati_equation(scale: float) -> None:
    """P from the closed loop's Lyapunov equation gives the same gains back (Kleinman 1968), and the loop is stable."""
    mass, viscous, tolerances = 3.0, 35.0, np.array([3e-4, 2e-3, 0.1, 15.0])
    gains = lqr.regulator(mass, viscous, scale, tolerances)[None]
    a, b = lqr.error_dynamics(mass, viscous, scale)
    weights = np.diag((np.array([scale, scale, scale, 1 / scale]) / tolerances) ** 2)
    effort = np.array([[1 / (scale * lqr.RATE_TOLERANCE) ** 2]])
    closed = a - b @ gains
    cost = solve_continuous_lyapunov(closed.T, -(weights + gains.T @ effort @ gains))
    np.testing.assert_allclose(np.linalg.solve(effort, b.T @ cost), gains, rtol=1e-6)
    hamiltonian = np.block([[a, -b @ np.linalg.solve(effort, b.T)], [-weights, -a.T]])
    stable = [root for root in np.linalg.eigvals(hamiltonian) if root.real < 0]
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(closed)), np.sort_complex(stable), rtol=1e-5)


def test_the_linear_model_is_the_control_model_about_rest() -> None:
    """Differences of (5), derived in SymPy: what speed and force do to each piston."""
    rig, rest = TILTED.replace({"cylinder2.coulomb_friction": 0.0, "cylinder1.coulomb_friction": 0.0}), [0.02, -0.05]
    acceleration = derived.accelerations(rig, 0.01, True)
    kappa = np.hypot(*geometry.jacobian(np.array(rest), rig)[:, 0])
    for i, (cylinder, scale) in enumerate(((rig.cylinder1, kappa), (rig.cylinder2, 1.0))):
        a, _ = lqr.error_dynamics(rig.mechanics.mass, cylinder.viscous_friction, scale)
        for column, slot, size in ((2, 2 + i, 1e-5), (3, 4 + i, 1.0)):
            ahead, behind = ([*rest, 0.0, 0.0, 50.0, 30.0] for _ in range(2))
            ahead[slot] += size
            behind[slot] -= size
            assert (acceleration(*ahead)[i] - acceleration(*behind)[i]) / (2 * size) == pytest.approx(a[2, column], rel=1e-6)


def test_the_schedule_covers_the_workspace_and_is_fine_enough() -> None:
    rig, tolerances = TILTED, np.array([4e-4, 3e-3, 0.2, 20.0])
    law = LinearQuadratic(rig, **dict(zip(LinearQuadratic.TUNABLE, tolerances, strict=False)))
    table, low, step, *_ = law._designs["lab"]
    high = low + step * (lqr.SCHEDULE - 1)
    strokes = np.array(np.meshgrid(np.linspace(-0.5, 0.5, 41), np.linspace(-0.5, 0.5, 5))).reshape(2, -1)
    kappa = np.hypot(*geometry.jacobian(strokes * [[rig.cylinder1.stroke], [rig.cylinder2.stroke]], rig)[:, 0])
    assert low == pytest.approx(kappa.min(), rel=1e-3)
    assert high == pytest.approx(kappa.max(), rel=1e-3)
    for value in kappa[::10]:
        exact = lqr.regulator(rig.mechanics.mass, rig.cylinder1.viscous_friction, value, tolerances)
        place = (value - low) / step
        read = [lqr.scheduled.py_func(table, row, place) for row in range(4)]
        np.testing.assert_allclose(read, exact, rtol=2e-3)


# On the control model


def on_the_model(law: Follower, rig: Parameters, start: Array, reference: Reference, seconds: float) -> Iterator[Array]:
    """States y1, y2, v1, v2, Pp1, Pn1, Pp2, Pn2 of the control model (5), (6) under a law at 1 kHz, valves without lag."""
    acceleration, cylinders = derived.accelerations(rig, 0.01, True), (rig.cylinder1, rig.cylinder2)

    def slope(x: Array, openings: Array) -> Array:
        flows = [derived.net_flow(s, p, rig) for s, p in zip(openings, x[4:], strict=True)]
        air = [
            derived.chamber_rates(x[4 + j : 6 + j], flows[j : j + 2], x[i], x[2 + i], c, rig)
            for i, (j, c) in enumerate(zip((0, 2), cylinders, strict=True))
        ]
        return np.array([*x[2:4], *acceleration(*x[:4], *derived.forces(x[4:], rig)), *air[0], *air[1]])

    x = start.copy()
    for _ in range(round(seconds / PERIOD)):
        openings = law.command(derived.seen(x[:2, None], x[2:4, None], x[4:, None].copy(), rig), reference)[:, 0]
        assert np.abs(openings).max() < 1
        yield x
        k1 = slope(x, openings)
        k2 = slope(x + PERIOD / 2 * k1, openings)
        k3 = slope(x + PERIOD / 2 * k2, openings)
        x = x + PERIOD / 6 * (k1 + 2 * k2 + 2 * k3 + slope(x + PERIOD * k3, openings))


def beside_rest(rig: Parameters, offset: Array) -> tuple[Array, Reference, Array, Array]:
    """A state at rest in balance but for an ``offset`` (2,) of the pistons; its reference; the forces at rest; kappa and 1."""
    wanted = np.array([0.01, -0.03, 0, 0, 0, 0, 0, 0.0])[:, None]
    reference = derived.cartesian(wanted, rig)
    reference.rows[8:10], reference.rows[10:12] = 2000.0, closed_loop.PNEUMATIC_STIFFNESS
    needed = prepared(wanted, np.zeros((2, 1)), rig, 0.0)[:, 0]
    air = [
        derived.pressures_for(needed[i], closed_loop.PNEUMATIC_STIFFNESS[i, 0], wanted[i, 0] + offset[i], cylinder, rig)
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2))
    ]
    start = np.concatenate([wanted[:2, 0] + offset, np.zeros(2), *air])
    return start, reference, needed[:2], np.array([needed[4], 1.0])


def test_lqr_moves_the_control_model_as_its_linear_model_says() -> None:
    """From 0.1 mm beside the target: every error follows exp((A - B k) t), sampled at 1 kHz."""
    rig, tolerances = FRICTIONLESS, np.array([4e-4, 3e-3, 0.2, 20.0])
    law = LinearQuadratic(
        rig, **dict(zip(LinearQuadratic.TUNABLE, tolerances, strict=False)), friction_share=0.0, dead_zone=0.0
    )
    offset = np.array([1e-4, -1e-4])
    start, reference, rest, scale = beside_rest(rig, offset)
    path = np.array(list(on_the_model(law, rig, start, reference, 0.4)))
    position, excess = path[:, :2] - (start[:2] - offset), np.array([derived.forces(x[4:], rig) for x in path]) - rest
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        a, b = lqr.error_dynamics(rig.mechanics.mass, cylinder.viscous_friction, scale[i])
        gains = lqr.regulator(rig.mechanics.mass, cylinder.viscous_friction, scale[i], tolerances)[None]
        # One period of a held input, exactly: exp of [[A, B], [0, 0]].
        step = expm(np.block([[a, b], [np.zeros((1, 5))]]) * PERIOD)
        errors = [np.array([0.0, offset[i], 0.0, 0.0])]
        for _ in range(len(path) - 1):
            errors.append((step[:4, :4] - step[:4, 4:] @ gains) @ errors[-1])
        predicted = np.array(errors)
        assert np.abs(predicted[-1, 1]) < 0.05 * abs(offset[i])
        assert np.abs(position[:, i] - predicted[:, 1]).max() < 0.03 * abs(offset[i])
        assert np.abs(excess[:, i] - predicted[:, 3]).max() < 0.05 * np.abs(predicted[:, 3]).max()


def test_sliding_mode_reaches_its_layer_when_predicted_and_decays_there() -> None:
    """|s| falls at h until h/b, in (|s0| - h/b)/h; then s decays at b, and errors as the triple pole at r.

    Weightless: the law takes the weight at the reference pose, and s would otherwise count what it changes on the way there.
    """
    rig, r, reaching, inside = FRICTIONLESS.replace({"mechanics.gravity": 0.0}), 25.0, 15.0, 60.0
    law = SlidingMode(rig, surface_rate=r, reaching_rate=reaching, layer_rate=inside, friction_share=0.0, dead_zone=0.0)
    start, reference, _, scale = beside_rest(rig, np.array([-5e-4, 1.2e-3]))
    path = np.array(list(on_the_model(law, rig, start, reference, 0.7)))
    target = start[:2] - np.array([-5e-4, 1.2e-3])
    error, summed = path[:, :2] - target, np.zeros((len(path), 2))
    summed[1:] = np.cumsum(error[:-1], axis=0) * PERIOD
    model = derived.accelerations(rig, 0.01, True)
    acceleration = np.array([model(*x[:4], *derived.forces(x[4:], rig)) for x in path])
    surface = scale * (acceleration + 3 * r * path[:, 2:4] + 3 * r**2 * error + r**3 * summed)
    layer = reaching / inside
    for i in range(2):
        size = np.abs(surface[:, i])
        predicted = (size[0] - layer) / reaching
        assert 0.05 < predicted < 0.2
        reached = int(np.argmax(size <= layer)) * PERIOD
        assert reached == pytest.approx(predicted, abs=0.002)
        before = size[: round((reached - 0.01) / PERIOD)]
        np.testing.assert_allclose(-np.diff(before) / PERIOD, reaching, rtol=0.08)
        tick = round(reached / PERIOD)
        later = np.log(size[tick + 40] / size[tick + 10]) / (30 * PERIOD)
        assert -later == pytest.approx(inside, rel=0.15)
        assert np.all(size[tick:] <= layer)
    assert np.abs(error[-1]).max() < 2e-5


# On the plant


def lab_sense(rig: Parameters, lanes: int) -> Callable[..., Measurement]:
    sensors = LabSensors(rig.electronics, lanes)
    for lane in range(lanes):
        sensors.begin(lane, np.random.default_rng([5, lane]))
    return lambda plant, time, force: sensors.measure(
        np.full(lanes, round(time / PERIOD)), np.full(lanes, time), plant.end_effector(), plant.pressures, force
    )


def circle_error(command: Callable[..., Array], rig: Parameters, lab: bool) -> tuple[float, float]:
    """RMS and largest distance from a circle of 50 mm in 4 s after 1 s, m, over four lanes."""
    reference = lambda time: closed_loop.circling(time, 0.05, 4.0, 2000.0, 4)  # noqa: E731
    plant, errors = closed_loop.resting_at(reference(0.0), rig), []
    sense = lab_sense(rig, 4) if lab else closed_loop.ideal
    for time, wanted, _, _ in closed_loop.run(plant, command, reference, lambda t: np.zeros((2, 4)), 4.0, sense):
        if time > 1:
            errors.append(np.hypot(*(plant.end_effector()[:2] - wanted.position)))
    return float(np.sqrt(np.mean(np.square(errors)))), float(np.max(errors))


HEAVY = Parameters().replace({"mechanics.mass": 4.0})
"""LuGre friction, and a kilogram more than the controllers believe."""


@pytest.fixture(scope="module")
def papers_law() -> float:
    """The RMS error of the paper's law with weight compensation, whose stiffness the wrong weight bends: 4.6 mm."""
    return circle_error(BacksteppingController(weight_compensation=True).command, HEAVY, False)[0]


@every_rival
@pytest.mark.parametrize(("lab", "share"), [(False, 0.13), (True, 0.35)], ids=["ideal", "lab"])
def test_a_rival_stays_on_the_circle(rival: type[Follower], lab: bool, share: float, papers_law: float) -> None:
    """Measured with exact sensors: PID 0.15, LQR 0.22, sliding mode 0.48 mm RMS; with the tracker 0.70, 0.62 and 1.3 mm."""
    typical, worst = circle_error(rival().command, HEAVY, lab)
    assert typical < share * papers_law
    assert worst < 6e-3


def test_without_control_the_end_effector_is_nowhere_near() -> None:
    assert circle_error(lambda measured, wanted: np.zeros((4, 4)), Parameters(), False)[0] > 0.03


@every_rival
def test_a_rival_renders_the_stiffness(rival: type[Follower]) -> None:
    """LuGre friction, a rig 1 kg heavier than believed: pushed by 20 N, it gives way as asked, in any direction."""
    stiffness = np.array([[1000.0, 2000.0, 4000.0, 2000.0], [1000.0, 2000.0, 4000.0, 4000.0]])
    reference = closed_loop.holding(np.repeat([[0.5], [0.02]], 4, axis=1), stiffness)
    reference.rows[14] = [0.0, 0.0, 0.0, 800.0]
    plant = closed_loop.resting_at(reference, Parameters().replace({"mechanics.mass": 4.0}))
    push = np.array([[20.0, 0.0, -20.0, 12.0], [0.0, -20.0, 0.0, 16.0]])
    for _ in closed_loop.run(plant, rival().command, lambda t: reference, lambda t: push * np.clip(t, 0, 1), 2.5):
        pass
    expected = [
        np.linalg.solve([[kx, kxy], [kxy, ky]], f)
        for (kx, ky), kxy, f in zip(stiffness.T, reference.rows[14], push.T, strict=True)
    ]
    np.testing.assert_allclose(plant.end_effector()[:2] - reference.position, np.transpose(expected), atol=6e-4)


# Lanes, memory, bad input


def signals(lanes: int, calls: int, sampled: bool) -> list[tuple[Measurement, Reference]]:
    """Situations that move from call to call; ``sampled`` as a tracker shows them."""
    rng, found = np.random.default_rng(6), []
    middle = rng.uniform(-0.5, 0.5, (2, lanes)) * [[0.15], [0.3]]
    wanted = closed_loop.holding(geometry.end_effector(middle, Parameters()), rng.uniform(1000, 4000, (2, lanes)))
    balanced = closed_loop.resting_at(wanted, Parameters()).pressures
    for call in range(calls):
        piston, speed = middle + 2e-5 * rng.normal(0, 1, (2, lanes)), 1e-4 * rng.normal(0, 1, (2, lanes))
        measured = derived.seen(piston, speed, balanced + 300 * rng.normal(0, 1, (4, lanes)), Parameters())
        clock = np.full(lanes, call * PERIOD)
        changes = {
            "time": clock,
            "position_time": np.floor(clock / 0.004 + 1e-9) * 0.004 if sampled else clock,
            "user_force": rng.normal(0, 1, (2, lanes)),
            "sampled": sampled,
        }
        found.append((dataclasses.replace(measured, **changes), wanted))
    return found


def of_lanes(pair: tuple[Measurement, Reference], lanes: Any) -> tuple[Measurement, Reference]:
    """The same signals for some lanes, or for one rig without lanes where ``lanes`` is a number."""
    measured, reference = pair
    fields = ("time", "position", "position_time", "velocity", "pressures", "user_force")
    some = {name: np.array(getattr(measured, name)[..., lanes], order="C") for name in fields}
    return Measurement(**some, sampled=measured.sampled), Reference(np.ascontiguousarray(reference.rows[:, lanes]))


@every_rival
@pytest.mark.parametrize("sampled", [False, True], ids=["ideal", "lab"])
def test_one_rig_is_one_lane_of_many(rival: type[Follower], sampled: bool) -> None:
    path, law = signals(40, 30, sampled), rival()
    together = np.array([law.command(*pair) for pair in path])
    assert len(np.unique(together[-1])) > 100
    for lane in (0, 31, 39):
        alone = rival()
        got = np.array([alone.command(*of_lanes(pair, lane)) for pair in path])
        assert got.shape == (30, 4)
        assert np.array_equal(got, together[:, :, lane])


@every_rival
def test_reset_of_some_lanes_starts_only_those_anew(rival: type[Follower]) -> None:
    path, masked = signals(3, 40, False), np.array([False, True, False])
    kept, reset, late = rival(), rival(), rival()
    for tick, pair in enumerate(path):
        if tick == 20:
            reset.reset(masked)
        expected, got = kept.command(*pair), reset.command(*pair)
        assert np.array_equal(got[:, ~masked], expected[:, ~masked])
        if tick >= 20:
            assert np.array_equal(got[:, 1:2], late.command(*of_lanes(pair, slice(1, 2))))
            assert not np.array_equal(got[:, 1], expected[:, 1])
    reset.reset()
    assert np.array_equal(reset.command(*path[0]), rival().command(*path[0]))


@every_rival
def test_integrals_rest_while_a_valve_is_full(rival: type[Follower]) -> None:
    """Half a second far from the target, then back on it: no more than the integral's start remains (no windup)."""
    law, position = rival(), np.array([[0.5], [0.0]])
    reference = closed_loop.holding(position, 2000.0)
    plant = closed_loop.resting_at(reference, Parameters())
    near = closed_loop.ideal(plant, 0.0, np.zeros((2, 1)))
    first = law.command(near, reference)
    far = dataclasses.replace(near, position=position + np.array([[0.06], [0.06]]))
    openings = np.array([law.command(far, reference) for _ in range(500)])
    assert np.all(np.abs(openings).reshape(500, 2, 2).max(axis=2) == 1)
    np.testing.assert_allclose(law.command(near, reference), first, atol=1e-12)


def test_the_integral_of_the_pid_rests_while_the_supply_gives_no_more() -> None:
    """Full chambers need no open valve: the limit of the force itself holds the integral."""
    rig, law = Parameters(), PositionPID(integral_rate=10.0)
    reference = closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0)
    full, empty = rig.air.supply_pressure, rig.air.atmospheric_pressure
    start = closed_loop.ideal(closed_loop.resting_at(reference, rig), 0.0, np.zeros((2, 1)))
    for offset, pressures in ((-0.06, [empty, full, full, empty]), (0.06, [full, empty, empty, full])):
        changes = {"position": start.position + offset * np.array([[1.0], [1.0]]), "pressures": np.array(pressures)[:, None]}
        law.reset()
        law.command(dataclasses.replace(start, position=changes["position"]), reference)
        before = law._integral.copy()
        for _ in range(10):
            openings = law.command(dataclasses.replace(start, **changes), reference)
        assert np.abs(openings).max() < 1
        assert np.array_equal(law._integral, before)


@every_rival
def test_the_observer_is_told_what_is_known(rival: type[Follower], monkeypatch: pytest.MonkeyPatch) -> None:
    """The measured force, and in which lanes the compliant motion is faster than 1 mm/s."""
    told, law = [], rival()
    update = law._observer.update
    monkeypatch.setattr(law._observer, "update", lambda m, f, moving: told.append((f, moving)) or update(m, f, moving=moving))
    ((measured, reference),) = signals(2, 1, True)
    reference.rows[2] = [2e-3, 5e-4]
    law.command(measured, reference)
    force, moving = told[0]
    assert np.array_equal(force, measured.user_force)
    assert moving.tolist() == [1, 0]


def test_the_dead_zone_is_continuous() -> None:
    errors = np.linspace(-3, 3, 61)
    kept = np.array([beyond.py_func(error, 1.0) for error in errors])
    np.testing.assert_allclose(kept, np.sign(errors) * np.maximum(np.abs(errors) - 1, 0), atol=1e-15)


@every_rival
def test_a_piston_past_its_stroke_gets_finite_openings(rival: type[Follower]) -> None:
    rig = Parameters()
    past = np.array([[1, -1, 1, -1], [1, 1, -1, -1]]) * np.array([[0.1005], [0.2005]])
    measured = derived.seen(past, np.zeros((2, 4)), np.full((4, 4), 4e5), rig)
    openings = rival(rig).command(measured, closed_loop.holding(measured.position, 2000.0))
    assert np.all(np.abs(openings) <= 1)


@every_rival
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_gains_that_cannot_be_are_refused(rival: type[Follower], value: float) -> None:
    for name, (low, _) in rival.TUNABLE.items():
        allowed = "zero or a positive number" if low == 0 else "a positive number"
        with pytest.raises(ValueError, match=f"{name} = {value!r}; allowed: {allowed}"):
            rival(**{name: value})
        if low == 0:
            rival(**{name: 0.0})
        else:
            with pytest.raises(ValueError, match=f"{name} = 0; allowed: a positive number"):
                rival(**{name: 0})


@every_rival
def test_signals_over_different_lanes_are_refused(rival: type[Follower]) -> None:
    (measured, reference), law = signals(3, 1, False)[0], rival()
    fewer, fewer_wanted = of_lanes((measured, reference), slice(1))
    for name in ("velocity", "pressures", "user_force"):
        mixed = dataclasses.replace(measured, **{name: getattr(fewer, name)})
        with pytest.raises(ValueError, match=rf"measurement.{name} has shape \(\d, 1\); allowed: \(\d, 3\)"):
            law.command(mixed, reference)
    with pytest.raises(ValueError, match=r"reference.rows has shape \(15, 1\); allowed: \(15, 3\)"):
        law.command(measured, fewer_wanted)


def test_rivals_go_by_name() -> None:
    for name, kind in zip(("pid", "lqr", "sliding-mode"), RIVALS, strict=True):
        assert type(make_controller(name, Parameters(), friction_share=0.25)) is kind
