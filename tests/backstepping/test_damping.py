"""Gains for a damping beside the stiffness: their range, and what they render on the whole plant."""

import numpy as np
import pytest

from baselines import BacksteppingController
from baselines.backstepping.gains import equal_gain, gains_for, least_damping, least_stiffness
from baselines.bench.probes import POSES
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.backstepping.test_gains import rigs
from tests.oracles import closed_loop
from tests.oracles.closed_loop import FRICTIONLESS
from tests.oracles.gain_range import closed_loop_damping, closed_loop_stiffness, damping_range


def random_gains(count: int, seed: int) -> list[tuple[Array, float, float]]:
    """Gains from 0.3 to 300 1/s, apparent mass and viscous friction, such that K is positive."""
    rng, found = np.random.default_rng(seed), []
    for mass, viscous in rigs(count, seed):
        gains = 10 ** rng.uniform(-0.5, 2.5, 3)
        if gains.sum() > 1.001 * viscous / mass:
            found.append((gains, mass, viscous))
    return found


def test_every_gains_lie_in_the_range_of_their_sum() -> None:
    for gains, mass, viscous in random_gains(200, 6):
        stiffness, damping = closed_loop_stiffness(*gains, mass, viscous), closed_loop_damping(*gains, mass, viscous)
        span = damping_range(stiffness, mass, viscous, gains.sum())
        assert span is not None
        slack = 1e-7 * max(map(abs, span))
        assert span[0] - slack <= damping <= span[1] + slack


@pytest.mark.parametrize(
    ("stiffness", "mass", "viscous", "gain_sum"), [(2000, 3, 35, 150), (4000, 12, 35, 170), (300, 2, 60, 70)]
)
def test_the_range_has_no_hole_and_nothing_lies_beyond(stiffness: float, mass: float, viscous: float, gain_sum: float) -> None:
    """Against a fine grid of c1 and c2 with that sum, of which those near the stiffness are kept."""
    c1, c2 = np.meshgrid(*[np.linspace(0, gain_sum, 1501)[1:-1]] * 2)
    c3 = gain_sum - c1 - c2
    pole = gain_sum - viscous / mass
    rendered = mass * (c1 + c3 + c1 * c2 * c3) / pole
    near = (c3 > 0) & (np.abs(rendered / stiffness - 1) < 0.002)
    dampings = np.sort((mass * (c1 * c2 + c1 * c3 + c2 * c3 + 2) - stiffness)[near] / pole)
    low, high = damping_range(stiffness, mass, viscous, gain_sum) or (0, 0)
    assert dampings[0] == pytest.approx(low, rel=0.005)
    assert dampings[-1] == pytest.approx(high, rel=0.005)
    assert np.diff(dampings).max() < 0.02 * (high - low)


def test_the_sum_of_the_gains_is_as_small_as_possible() -> None:
    """c1 = c3 >= c2; no sum smaller by 0.2 % (of setpoints above 300 N/m) has positive gains for this stiffness and damping."""
    rng = np.random.default_rng(8)
    for _ in range(60):
        mass, viscous, stiffness = rng.uniform(2, 15), rng.uniform(0, 60), rng.uniform(1000, 5000)
        least = least_damping(stiffness, mass, viscous)
        damping = least * rng.choice([1.0, 1.01, 1.3, 3.0])
        c = gains_for(stiffness, mass, viscous, damping)
        assert c[0] == c[2] > 0.99 * c[1] > 0
        assert closed_loop_stiffness(*c, mass, viscous) == pytest.approx(stiffness, rel=1e-9)
        assert closed_loop_damping(*c, mass, viscous) == pytest.approx(damping, rel=1e-6)
        span = damping_range(stiffness, mass, viscous, 0.998 * sum(c))
        assert span is None or not span[0] <= damping <= span[1]


def test_equal_gains_are_the_least_damped() -> None:
    """No positive gains with their sum or a larger one render 0.1 % less damping; ``least_damping`` is what they render."""
    rng = np.random.default_rng(9)
    for _ in range(20):
        mass, viscous, stiffness = rng.uniform(2, 15), rng.uniform(0, 60), rng.uniform(1000, 5000)
        c = equal_gain(stiffness, mass, viscous)
        damping = closed_loop_damping(c, c, c, mass, viscous)
        assert least_damping(stiffness, mass, viscous) == pytest.approx(damping, rel=1e-4)
        spans = [damping_range(stiffness, mass, viscous, 3 * c * (1 + more)) for more in np.geomspace(1e-6, 30, 60)]
        assert min(span[0] for span in spans if span) > 0.999 * damping
        with pytest.raises(
            ValueError, match=rf"no positive gains .* allowed: at least {least_damping(stiffness, mass, viscous):.6g}"
        ):
            gains_for(stiffness, mass, viscous, 0.999 * least_damping(stiffness, mass, viscous))
    frictionless = equal_gain(2000, 3, 0)
    ratio = closed_loop_damping(*[frictionless] * 3, 3, 0) / (2 * np.sqrt(2000 * 3))
    assert ratio == pytest.approx(4 / 27 * np.sqrt(27), rel=1e-3), "0.77: the limit without couplings and friction"


def ramped(law: BacksteppingController, setpoints: Array, axes: Array, poses: Array, speed: Array) -> Array:
    """Displacement over time (T, N) along ``axes``: half a second of it, after 1.5 s of a force that grows by K ``speed``."""
    reference, lanes = closed_loop.holding(poses, setpoints), np.arange(setpoints.size)
    plant = closed_loop.resting_at(reference, law.parameters)
    growth = setpoints * speed * (axes == np.array([[0], [1]]))
    path = []
    for time, _, _, _ in closed_loop.run(plant, law.command, lambda t: reference, lambda t: growth * t, 2.0):
        if time >= 1.5:
            path.append((plant.end_effector()[:2] - reference.position)[axes, lanes])
    return np.array(path)


@pytest.mark.parametrize(("ratio", "tolerance"), [(0.9, 0.045), (1.3, 0.025)])
def test_stiffness_and_damping_asked_for_are_rendered(ratio: float, tolerance: float) -> None:
    """A force that grows steadily is followed at the speed of K and late by B/K, both read off a straight line.

    Poses, axes and 1000 to 4000 N/m; the mean of both directions, in which the turning of the linkage cancels. What is
    missing is the air's: by dead volume and heat dF/dt is not quite (10), and B lacks that error per speed over a2 - phi.
    """
    cases = 2 * [(pose, setpoint, axis) for pose in POSES for setpoint in (1000.0, 2000.0, 4000.0) for axis in (0, 1)]
    poses, setpoints, axes = (np.array(column) for column in zip(*cases, strict=True))
    speed, law = 0.003, BacksteppingController(FRICTIONLESS, weight_compensation=True, damping_ratio=ratio)
    ways = speed * np.repeat([1, -1], len(cases) // 2)
    forth, back = np.hsplit(ramped(law, setpoints, axes, np.ascontiguousarray(poses.T), ways), 2)
    setpoints = setpoints[: len(cases) // 2]
    # A force held over each period is on average half a period old.
    times = 1.5 + 0.001 * np.arange(forth.shape[0]) - 0.0005
    slope, start = np.polyfit(times, (forth - back) / 2, 1)
    damping = 2 * ratio * np.sqrt(FRICTIONLESS.mechanics.mass * setpoints)
    np.testing.assert_allclose(setpoints * speed / slope, setpoints, rtol=0.005)
    np.testing.assert_allclose(-start / slope * setpoints, damping, rtol=tolerance)


def test_the_damping_ratio_stays_when_the_setpoint_changes_under_force() -> None:
    """From 2000 to 4000 N/m within one control period, pushed with 10 N: half the displacement, reached without overshoot."""
    position, push = np.array([[0.5], [0.0]]), np.full((2, 1), 10.0)
    soft, stiff = (closed_loop.holding(position, setpoint) for setpoint in (2000.0, 4000.0))
    plant = closed_loop.resting_at(soft, FRICTIONLESS)
    law, path = BacksteppingController(FRICTIONLESS, weight_compensation=True, damping_ratio=1.2), []
    for _ in closed_loop.run(plant, law.command, lambda t: soft if t < 2 else stiff, lambda t: push * min(t, 1.0), 3.0):
        path.append((plant.end_effector()[:2] - position)[:, 0])
    np.testing.assert_allclose(path[1999], 0.005, rtol=0.01)
    np.testing.assert_allclose(path[-1], 0.0025, rtol=0.01)
    assert np.diff(path[2000:], axis=0).max() < 1e-6


def test_setpoints_without_gains_are_refused_by_lane() -> None:
    """The range named is that of the cylinder which has none: cylinder 2, whose apparent mass is the smaller."""
    least = least_stiffness(3.0, 35.0)
    reference = closed_loop.holding(np.array([[0.5] * 5, [0.0] * 5]), np.array([[2000.0, 2000, 2000, 50, 40]] * 2))
    plant = closed_loop.resting_at(reference, FRICTIONLESS)
    measured = closed_loop.ideal(plant, 0.0, np.zeros((2, 5)))
    with pytest.raises(ValueError, match=rf"\(50, 50\) N/m in lane 3, cylinder 2: .* allowed: more than {least:g} N/m"):
        BacksteppingController().command(measured, reference)
    reference.rows[8:10] = 2000.0
    lowest = least_damping(2000.0, 3.0, 35.0) / (2 * np.sqrt(2000 * 3))
    assert np.isfinite(BacksteppingController(damping_ratio=lowest * 1.0001).command(measured, reference)).all()
    with pytest.raises(ValueError, match=rf"lane 0, cylinder 2: .*\(ratio 0.7892\) .* at 2000 N/m .*\(ratio {lowest:.4g}\)"):
        BacksteppingController(damping_ratio=lowest * 0.99).command(measured, reference)
    reference.rows[8:10, 2] = -1.0
    with pytest.raises(ValueError, match=r"lane 2, cylinder 1: stiffness = -.*; allowed: a positive number"):
        BacksteppingController(damping_ratio=1.0).command(measured, reference)


@pytest.mark.parametrize("ratio", [None, 1.0])
def test_a_lane_out_of_range_stops_no_other(ratio: float | None) -> None:
    """A state that is not a number is the plant's trouble, not a setpoint without gains."""
    reference = closed_loop.holding(np.array([[0.5, 0.5], [0.0, 0.0]]), 2000.0)
    measured = closed_loop.ideal(closed_loop.resting_at(reference, Parameters()), 0.0, np.zeros((2, 2)))
    measured.position[:, 0] = np.nan
    openings = BacksteppingController(damping_ratio=ratio).command(measured, reference)
    assert np.isfinite(openings[:, 1]).all()
    reference.rows[8:10, 1] = 40.0
    with pytest.raises(ValueError, match=r"in lane 1, cylinder 2: .* allowed: "):
        BacksteppingController(damping_ratio=ratio).command(measured, reference)
