"""Pieces of the admittance law, with the figures that its constants stand for."""

import numpy as np
import pytest

from baselines.admittance import law
from baselines.admittance.rows import HalfWave
from birthsim_env.physics.rig.parameters import Parameters
from tests.controllers.test_admittance_backstepping import PERIOD, commanded, near
from tests.oracles import derived_law as derived
from tests.oracles import rigid_body


def test_the_pneumatic_stiffness_goes_where_the_reference_asks_at_c4() -> None:
    """dK/dt of the chambers is the reference's rate less 30 1/s times the error, of each cylinder, beside the force."""
    rig, lanes, rng = Parameters(), 40, np.random.default_rng(3)
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


def test_position_errors_count_up_to_six_millimetres() -> None:
    rig = Parameters().replace({"valves.sonic_conductance": 2e-8})
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
