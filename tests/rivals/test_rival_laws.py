"""PID, LQR and sliding mode: each law against formulas derived anew, and its motion on the control model."""

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from baselines.estimation.stages import MOTION
from baselines.rivals import lqr, pid
from baselines.rivals.feedforward import SIGN_WIDTH, Tracking, feedforward
from baselines.rivals.lqr import LinearQuadratic
from baselines.rivals.pid import PositionPID
from baselines.rivals.sliding_mode import SlidingMode
from baselines.rivals.tracking import TrackingController
from baselines.valve_inverse import CylinderAir
from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import INTERMEDIATE, Seen
from birthsim_env.loop.signals import Reference
from birthsim_env.loop.stage import Stage
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles import derived_law as derived
from tests.oracles.closed_loop import IDEAL
from tests.physics.rigs import TILTED

PERIOD = 1e-3


MIDDLE = np.array([[3e5], [4e5], [5e5], [3.5e5]])
"""Pa: pressures that press the seals."""


def prepared(
    joints: Array,
    force: Array,
    rig: Parameters,
    fraction: float,
    force_rate: Array | float = 0.0,
    pressures: Array = MIDDLE,
) -> Array:
    """What the stage finds needed, (5, N), for a motion of the joints (8, N); its jerk lacks the user's ``force_rate`` / m."""
    motion = derived.cartesian(joints, rig).rows[:8].copy()
    motion[6:8] -= force_rate / rig.mechanics.mass
    stage, lanes = feedforward(rig, fraction), joints.shape[1]
    wanted, needed = np.empty((8, lanes)), np.empty((5, lanes))
    placed = [
        (motion, MOTION),
        (force.copy(), Seen.user_force.first),
        (np.array(np.broadcast_to(pressures, (4, lanes))), Seen.pressure.first),
        (wanted, INTERMEDIATE + Tracking.wanted.first),
        (needed, INTERMEDIATE + Tracking.needed.first),
    ]
    Loop(lanes, [], placed, [Stage(stage.function, stage.constants, sees_world=False)]).run()
    np.testing.assert_allclose(wanted[:6], joints[:6], atol=1e-10)
    return needed


@pytest.mark.parametrize("rig", [Parameters(), TILTED], ids=["default", "tilted"])
def test_the_needed_force_gives_the_wanted_acceleration(rig: Parameters) -> None:
    """(5), derived in SymPy, with the smoothed friction of the reference and the user's force added by (17)."""
    rng, lanes, fraction = np.random.default_rng(1), 50, 0.6
    joints = rng.normal(0, 1, (8, lanes)) * np.repeat([0.03, 0.1, 1.0, 10.0], 2)[:, None]
    force = rng.normal(0, 30, (2, lanes))
    pressures = rng.uniform(1.1e5, 6.9e5, (4, lanes))
    needed = prepared(joints, force, rig, fraction, pressures=pressures)
    believed = fraction * np.array(derived.coulomb_levels(pressures, joints[2:4], rig))
    acceleration = derived.accelerations(rig, SIGN_WIDTH, True, believed)
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


def test_pressure_setpoints_give_force_and_pneumatic_stiffness() -> None:
    """(9) and F = Pp Sp - Pn Sn, where the supply can; else the force, with the nearest pressures that can be."""
    rng, cylinder, rig = np.random.default_rng(2), Parameters().cylinder1, Parameters()
    (ap, an), low, high = derived.areas(cylinder), rig.air.atmospheric_pressure, rig.air.supply_pressure
    y, stiffness = rng.uniform(-0.08, 0.08, 400), rng.uniform(1500, 6500, 400)
    force, index = rng.uniform(low * ap - high * an, high * ap - low * an, 400), rig.air.polytropic_index
    both = [
        pid.pressure_setpoints.py_func(f, k, CylinderAir(0, low, low, ap, an, 0.1 + at, 0.1 - at, 0.0), index, low, high)
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
    law = PositionPID(rig, **gains, friction_fraction=0.5, dead_zone=3e-4)
    wanted = np.array([0.01, -0.04, 0, 0, 0, 0, 0, 0.0])[:, None]
    reference = derived.cartesian(wanted, rig)
    reference.rows[8:10], reference.rows[10:12] = 2000.0, closed_loop.PNEUMATIC_STIFFNESS
    error, error_rate = np.array([2e-4, -1.5e-4]), np.array([0.002, -0.003])
    piston, speed = wanted[:2, 0] - error, -error_rate
    needed = prepared(wanted, np.zeros((2, 1)), rig, 0.5)[:, 0]
    pressures = derived.air_for(needed[:2] + 4.0, 1.01 * closed_loop.PNEUMATIC_STIFFNESS[:, 0], piston, rig)
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
    design = law._designs[True]
    low, step, table = design["lowest"], design["step"], design["table"]
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


def on_the_model(
    law: TrackingController, rig: Parameters, start: Array, reference: Reference, seconds: float
) -> Iterator[Array]:
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
    piston = wanted[:2, 0] + offset
    air = derived.air_for(needed[:2], closed_loop.PNEUMATIC_STIFFNESS[:, 0], piston, rig)
    start = np.concatenate([piston, np.zeros(2), air])
    return start, reference, needed[:2], np.array([needed[4], 1.0])


def test_lqr_moves_the_control_model_as_its_linear_model_says() -> None:
    """From 0.1 mm beside the target: every error follows exp((A - B k) t), sampled at 1 kHz; valves are linear."""
    rig, tolerances = IDEAL, np.array([4e-4, 3e-3, 0.2, 20.0])
    law = LinearQuadratic(
        rig, **dict(zip(LinearQuadratic.TUNABLE, tolerances, strict=False)), friction_fraction=0.0, dead_zone=0.0
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
    """Weightless: |s| falls at h until h/b, in (|s0| - h/b)/h; then s decays at b, and errors as the triple pole at r.

    Of linear valves: others leave some of the flow out while they cross their overlap.
    """
    rig, r, reaching, inside = IDEAL.replace({"mechanics.gravity": 0.0}), 25.0, 15.0, 60.0
    law = SlidingMode(rig, surface_rate=r, reaching_rate=reaching, layer_rate=inside, friction_fraction=0.0, dead_zone=0.0)
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
