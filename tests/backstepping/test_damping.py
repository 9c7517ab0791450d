"""Gains for a damping beside the stiffness: their range, and what they render on the whole plant."""

import numpy as np
import pytest

from baselines import BacksteppingController
from baselines.backstepping import gains, law
from baselines.backstepping.gains import gains_for, least_damping, least_stiffness
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles.closed_loop import FRICTIONLESS, IDEAL
from tests.oracles.gain_range import closed_loop_damping, closed_loop_stiffness, damping_range

MASS = 3.0


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


@pytest.mark.parametrize(("stiffness", "viscous"), [(3.3, 0.5), (4.5, 6.0), (60.0, 35.0), (2000.0, 35.0)])
def test_the_least_damping_is_that_of_a_fine_search_and_soft_setpoints_get_more_too(stiffness: float, viscous: float) -> None:
    """Of all c1 = c3 that leave c2 positive, even where the setpoint is hardly above the least and small terms count."""
    k, drag, mass = stiffness / MASS, viscous / MASS, MASS
    outer = max(np.sqrt(k), k * drag / (2 * (k - 1))) * (1 + np.exp(np.linspace(-14, 6, 40001)))
    inner = gains.inner_gain(outer, stiffness, mass, viscous)
    assert np.all(inner > 0)
    least = gains.least_damping(stiffness, mass, viscous)
    searched = min(closed_loop_damping(c1, c2, c1, mass, viscous) for c1, c2 in zip(outer[::4], inner[::4], strict=True))
    assert least == pytest.approx(searched, rel=1e-6)
    ratio = least / (2 * np.sqrt(stiffness * mass))
    ratios = rf"\(ratio {0.999 * ratio:.4g}\) has no positive gains .* at least {least:.6g} N s/m \(ratio {ratio:.4g}\)"
    with pytest.raises(ValueError, match=ratios):
        gains_for(stiffness, mass, viscous, 0.999 * least)
    c = gains_for(stiffness, mass, viscous, 1.5 * least)
    assert closed_loop_stiffness(*c, mass, viscous) == pytest.approx(stiffness, rel=1e-9)
    assert closed_loop_damping(*c, mass, viscous) == pytest.approx(1.5 * least, rel=1e-9)


def test_gains_miss_where_they_render_another_damping_by_more_than_a_millionth() -> None:
    stiffness, damping, viscous = 2000.0, 900.0, 35.0
    outer = gains.outer_gain(stiffness, damping, MASS, viscous)
    inner = gains.inner_gain(outer, stiffness, MASS, viscous)
    at = (stiffness, damping, MASS, viscous)
    assert gains.damped_gains_miss(outer * (1 + 1e-8), inner, *at) == 0
    assert gains.damped_gains_miss(outer * (1 + 1e-4), inner, *at) == 1


@pytest.mark.parametrize(("ratio", "tolerance"), [(0.9, 0.045), (1.3, 0.025)])
def test_stiffness_and_damping_asked_for_are_rendered(ratio: float, tolerance: float) -> None:
    """A growing force is followed at the speed of K and late by B/K; in the mean of both ways the linkage's turning cancels.

    Linear valves: across an overlap the force hunts slowly (``test_rendered_stiffness``), and half a second has no steady lag.
    """
    probes, speed = closed_loop.pushes((1.0, -1.0)), 0.003
    law = BacksteppingController(IDEAL, weight_compensation=True, damping_ratio=ratio)
    reference, growth = closed_loop.holding(probes.position, probes.stiffness[0]), speed * probes.stiffness[0] * probes.force
    plant, path = closed_loop.resting_at(reference, IDEAL), []
    for time, _, _, _ in closed_loop.run(plant, law.command, lambda t: reference, lambda t: growth * t, 2.0):
        if time >= 1.5:
            path.append(((plant.end_effector()[:2] - reference.position) * probes.force).sum(axis=0))
    # A force held over each period is on average half a period old.
    times = 1.5 + 0.001 * np.arange(len(path)) - 0.0005
    slope, start = np.polyfit(times, np.reshape(path, (len(path), -1, 2)).mean(axis=2), 1)
    setpoints = probes.stiffness[0, ::2]
    damping = 2 * ratio * np.sqrt(IDEAL.mechanics.mass * setpoints)
    np.testing.assert_allclose(setpoints * speed / slope, setpoints, rtol=0.005)
    np.testing.assert_allclose(-start / slope * setpoints, damping, rtol=tolerance)


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
    with pytest.raises(ValueError, match=r"lane 0, cylinder 1: .*\(ratio 0.05\)"):
        BacksteppingController(damping_ratio=0.05).command(measured, reference)


def test_a_negative_setpoint_is_refused() -> None:
    reference = closed_loop.holding(np.array([[0.5], [0.0]]), -1.0)
    measured = closed_loop.ideal(closed_loop.resting_at(reference, FRICTIONLESS), 0.0, np.zeros((2, 1)))
    with pytest.raises(ValueError, match=r"lane 0, cylinder 1: stiffness = -.*; allowed: a positive number"):
        BacksteppingController(damping_ratio=1.0).command(measured, reference)


def test_lanes_without_gains_are_counted() -> None:
    """Of four lanes one has gains, two have none for either cylinder, and one for neither."""
    needs, found = law.GainInputs(np.zeros((law.GainInputs.size, 4))), law.Gains(np.zeros((law.Gains.size, 4)))
    needs.mass[:], needs.stiffness[:] = 4.0, [[2000.0, 1.0, 2000.0, 1.0], [2000.0, 2000.0, 1.0, 1.0]]
    rig = Rig(parameter_column(Parameters()))
    assert law.equal_gains(needs, rig, found, 4) == 3
    assert law.damped_gains(needs, rig, 1.3, found, 4) == 3


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
