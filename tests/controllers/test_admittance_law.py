"""Pieces of the admittance law, with the figures that its constants stand for."""

import numpy as np
import pytest

from baselines.admittance import law
from baselines.admittance.controller import AdmittanceController
from baselines.admittance.rows import Estimate, Gains, HalfWave, Memory
from birthsim_env.physics.rig.parameters import Parameters
from tests.controllers.test_admittance_backstepping import PERIOD, RIG, TIMES, answer, commanded, near, remembered
from tests.oracles import closed_loop, rigid_body
from tests.oracles import derived_law as derived


def test_the_pneumatic_stiffness_goes_where_the_reference_asks_at_c4() -> None:
    """dK/dt of the chambers is the reference's rate less 30 1/s times the error, of each cylinder, beside the force."""
    rig, lanes, rng = RIG, 40, np.random.default_rng(3)
    now = rigid_body.near_balance(rig, lanes, seed=7, speed=0.02, push=1.0)
    nothing = np.zeros((2, lanes))
    error, rate = rng.uniform(-20, 20, (2, lanes)), rng.uniform([[-300.0], [400.0]], [[-100.0], [700.0]], (2, lanes))
    motion, _ = near(now, rig, nothing, seed=1, fraction=0.1)
    openings = commanded(rig, now, motion, pneumatic=np.concatenate([now.stiffness - error, rate]))
    driven = (now.pressures > 1.1e5) & (now.pressures < 6.9e5)
    free = np.all((np.abs(openings) < 0.99) & driven, axis=0)
    assert free.sum() > 0.5 * lanes
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        for lane in np.flatnonzero(free):
            air = now.pressures[2 * i : 2 * i + 2, lane]
            flows = [derived.net_flow(openings[2 * i + j, lane], air[j], rig) for j in (0, 1)]
            at = (air, flows, now.piston[i, lane], now.speed[i, lane], cylinder, rig)
            assert derived.force_and_stiffness_rates(*at)[1] == pytest.approx(rate[i, lane] - 30 * error[i, lane], rel=1e-6)


def test_three_equal_gains_with_both_springs_of_backstepping() -> None:
    """(s + c)^3 with the 1 that each of two springs adds: 3 c, 3 c^2 + 2, c^3 + 2 c."""
    assert [law.jerk_for(1.0, 0.0, 0.0, c) for c in (1.0, 2.0)] == [3.0, 6.0]
    assert [law.jerk_for(0.0, 1.0, 0.0, c) for c in (1.0, 2.0)] == [5.0, 14.0]
    assert [law.jerk_for(0.0, 0.0, 1.0, c) for c in (1.0, 2.0)] == [3.0, 12.0]


def ended(peaks: list[float], seconds: float, level: float = 0.05) -> list[float]:
    """What ``sustained`` says at the end of each half wave of an error with these peaks, each ``seconds`` long."""
    wave, said = HalfWave(np.zeros((HalfWave.size, 1))), []
    for k, peak in enumerate([*peaks, peaks[-1]]):
        for tick in range(round(seconds / PERIOD)):
            way = (-1) ** k * peak * (1.0 if tick % 2 else 0.9)
            found = law.sustained(wave, 0, way, PERIOD, level, 0.0)
            if tick == 0:
                said.append(found)
            else:
                assert found == 0.0
    return said[1:]


def test_a_half_wave_of_four_fifths_is_sustained_and_one_of_seven_tenths_is_not() -> None:
    assert ended([1.0, 0.8, 0.64], 0.05) == pytest.approx([0.0, 0.8, 0.64])
    assert ended([1.0, 0.7, 0.49], 0.05) == [0.0, 0.0, 0.0]
    assert ended([0.5, 2.0], 0.05) == pytest.approx([0.0, 2.0]), "a growing one all the more"


def test_half_waves_count_where_they_go_beyond_the_level_within_a_fifth_of_a_second() -> None:
    assert ended([1.0, 0.9], 0.05, level=0.9) == [0.0, 0.0], "at the level is not beyond"
    assert ended([1.0, 0.91], 0.05, level=0.9) == pytest.approx([0.0, 0.91])
    assert ended([0.1, 0.1, 0.1], 0.19) == pytest.approx([0.0, 0.1, 0.1])
    assert ended([0.1, 0.1, 0.1], 0.21) == [0.0, 0.0, 0.0]


def test_swings_at_rest_lower_the_gain_to_no_less_than_055_and_it_comes_back_in_04_s() -> None:
    one, gains = remembered(1).follower.rest_along, Gains(Gains.lane(swing=0.02))
    swing = np.concatenate([0.03 * np.sin(2 * np.pi * 14 * TIMES[:1000]), np.zeros(800)])
    fraction = np.array([law.rest_gain_fraction(one, 0, error, PERIOD, gains) for error in swing])
    assert fraction[np.argmax(fraction < 1)] == 0.85
    assert fraction.min() == 0.55
    np.testing.assert_allclose(1 - fraction[1000:], (1 - fraction[1000]) * np.exp(-TIMES[:800] / 0.4), rtol=0.005)
    one, gains = remembered(1).follower.rest_along, Gains(Gains.lane(swing=0.04))
    assert all(law.rest_gain_fraction(one, 0, error, PERIOD, gains) == 1.0 for error in swing), "no swing within the level"


@pytest.mark.parametrize("speed", [0.005, 0.02])
def test_a_motion_goes_somewhere_by_the_square_of_its_mean_velocity_over_8_mm_s(speed: float) -> None:
    """The mean of a third of a second."""
    follower, motion = remembered(1).follower, Estimate(np.zeros((Estimate.size, 1))).motion
    motion.velocity[:, 0] = 0.6 * speed, -0.8 * speed
    mean = speed * (1 - np.exp(-3 * TIMES[1:]))
    found = [law.motion_fraction(follower, 0, motion, PERIOD) for _ in mean]
    np.testing.assert_allclose(found, np.minimum(1, (mean / 0.008) ** 2), rtol=0.01)


@pytest.mark.parametrize(("mean", "gone"), [(0.0, 0.0), (0.004, 0.25), (0.02, 1.0)])
def test_the_gain_is_calmed_as_far_as_the_motion_goes_nowhere(mean: float, gone: float) -> None:
    rig, c, memory = RIG, 50.0, remembered(1)
    now = rigid_body.near_balance(rig, 1, seed=4, speed=0.0, push=0.0)
    pose, follower = rigid_body.pose_of(now.piston, rig), memory.follower
    follower.drift[:, 0] = 0.6 * mean, -0.8 * mean
    follower.rest_across.fraction[:], follower.rest_along.fraction[:] = 0.7, 0.6
    for way, fraction in ((pose.across, 0.7), (pose.beam, 0.6)):
        left = c * (gone + (1 - gone) * fraction)
        assert answer(rig, now, way, memory, c, swing=0.02) == pytest.approx(left**3 + 2 * left, rel=0.01)
        assert answer(rig, now, way, memory, c) == pytest.approx(c**3 + 2 * c, rel=1e-4)


def test_observers_are_told_what_was_commanded() -> None:
    wanted = closed_loop.holding(np.array([[0.5, 0.55], [0.0, 0.05]]), 2000.0)
    measured = closed_loop.ideal(closed_loop.resting_at(wanted, Parameters()), 0.0, np.array([[5.0, 0.0], [0.0, -5.0]]))
    controller = AdmittanceController(Parameters())
    with np.errstate(all="ignore"):  # of a fresh observer's pressures, which it does not use; plain Python warns
        openings = controller.command(measured, wanted)
    assert np.ptp(openings, axis=1).all()
    np.testing.assert_array_equal(Memory(controller._memories[0]).chambers.opening, openings)


def test_position_errors_count_up_to_six_millimetres() -> None:
    rig = RIG.replace({"valves.sonic_conductance": 2e-8})
    now, nothing = rigid_body.near_balance(rig, 1, seed=4, speed=0.0, push=0.0), np.zeros((2, 1))
    jerks = []
    for error in (0.0059, 0.006, 0.0061, 0.05):
        motion, _ = near(now, rig, nothing, seed=1, fraction=0.0)
        # Along cylinder 2, by a gain at which no valve saturates.
        motion[:2] += error * (motion[:2] / np.linalg.norm(motion[:2], axis=0))
        openings = commanded(rig, now, motion, gain=10.0)
        assert np.abs(openings).max() < 1
        jerks.append(np.linalg.norm(rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)[1]))
    np.testing.assert_allclose(jerks, 1020 * np.array([0.0059, 0.006, 0.006, 0.006]), rtol=1e-4)
