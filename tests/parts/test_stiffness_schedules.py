"""Stiffness setpoints: closed-loop steps at the very instant, smooth pneumatic transitions, and refusals by name."""

import math

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env import StiffnessSchedule
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import find_scenario, studied_scenarios
from birthsim_env.registry import names
from tests.parts.test_moving_hands import minimum_jerk

CIRCLE = "BirthSIM/Circle-v2"
TWO = ((0.0, 0.8), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0))


def course(schedule, times, seed=0):
    """(7, len(times)) of one lane, one instant per call."""
    schedule.prepare(1)
    schedule.begin(0, stream(seed, 0, "stiffness"))
    return np.stack([schedule.sample(np.array([t]))[:, 0] for t in times], axis=1)


@given(st.integers(1, 20_000), st.sampled_from([1e-3, 2.5e-4, 1e-2, 5e-3]))
def test_a_phase_starts_on_its_control_instant_whatever_the_rounding(tick, period):
    # Clock and schedule may round the same instant differently: tick * period against the number a user writes.
    for start in (tick * period, math.nextafter(tick * period, 0), math.nextafter(tick * period, math.inf)):
        rows = course(StiffnessSchedule((0.0, start), *TWO[1:]), [(tick - 1) * period, tick * period, (tick + 1) * period])
        np.testing.assert_array_equal(rows[0], (2000.0, 4000.0, 4000.0))
        np.testing.assert_array_equal(rows[1], rows[0])
        assert rows[2, 1] == pytest.approx(4600.0)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_an_environment_changes_the_setpoint_at_the_phase_time(sensors):
    env = gymnasium.make(CIRCLE, sensors=sensors, stiffness=StiffnessSchedule(*TWO))
    infos = [env.reset(seed=0)[1]] + [env.step(np.zeros(4))[4] for _ in range(100)]
    for info in infos:
        late = info["time"] > 0.7995
        np.testing.assert_array_equal(info["stiffness_setpoint"], 4000.0 if late else 2000.0)
        assert info["since_jump"] == pytest.approx(info["time"] - 0.8 * late, abs=1e-9)
    for _ in range(40):
        info = env.step(np.zeros(4))[4]
    np.testing.assert_allclose(info["pneumatic_stiffness_setpoint"], (3600.0, 1800.0))


@pytest.mark.parametrize("transition", [0.05, 0.5, 2.0])
def test_transitions_are_minimum_jerk_with_rates_that_fit(transition):
    times = np.linspace(0.0, 3.0, 601)
    schedule = StiffnessSchedule(*TWO, transition=transition)
    rows = course(schedule, times)
    fraction, _ = minimum_jerk((times - 0.8) / transition)
    np.testing.assert_allclose(rows[2], 4600.0 - 1000.0 * fraction, atol=1e-6)
    np.testing.assert_allclose(rows[3], 2300.0 - 500.0 * fraction, atol=1e-6)
    step = 1e-6 * transition
    slope = (course(schedule, times + step)[2:4] - course(schedule, times - step)[2:4]) / (2 * step)
    np.testing.assert_allclose(rows[4:6], slope, atol=2e-5 * np.abs(slope).max())
    # Smooth at both ends: no rate there, and none outside.
    np.testing.assert_array_equal(rows[4:6, (times < 0.8) | (times > 0.8 + transition + 1e-9)], 0.0)
    assert rows[4].min() == pytest.approx(-1000.0 * 1.875 / transition, rel=1e-2)


def test_three_PHASES_each_go_on_from_the_one_before():
    schedule = StiffnessSchedule((0.0, 1.0, 2.0), (1e3, 2e3, 3e3), (3000.0, 4000.0, 3500.0), (1500.0, 2000.0, 1800.0))
    rows = course(schedule, [0.5, 1.25, 1.5, 2.25, 2.5, 9.0])
    np.testing.assert_allclose(rows[2], (3000, 3500, 4000, 3750, 3500, 3500))
    np.testing.assert_allclose(rows[0], (1e3, 2e3, 2e3, 3e3, 3e3, 3e3))


def varied_rows(name, lanes=300):
    """What a scenario's varied schedule asks for at 200 instants, (200, 7, lanes)."""
    schedule = find_scenario(name).varied()[2]
    schedule.prepare(lanes)
    for lane in range(lanes):
        schedule.begin(lane, stream(lane, 0, "stiffness"))
    return np.stack([schedule.sample(np.full(lanes, t)) for t in np.linspace(0, find_scenario(name).duration, 200)])


@pytest.mark.parametrize("name", names("scenario"))
def test_varied_schedules_stay_inside_the_feasible_range(name):
    # Feasible at mid stroke are 2400-5500 N/m on cylinder 1 and 1200-2800 N/m on cylinder 2.
    rows = varied_rows(name)
    for row, low, high in ((0, 1000, 5000), (1, 1000, 5000), (2, 2400, 5500), (3, 1200, 2800)):
        assert low <= rows[:, row].min() <= rows[:, row].max() <= high


@pytest.mark.parametrize("name", studied_scenarios())
def test_schedules_of_studies_are_drawn_and_alike_on_both_axes(name):
    rows = varied_rows(name, 20)
    assert np.ptp(rows[-1, 2]) > 0
    np.testing.assert_array_equal(rows[:, 0], rows[:, 1])


def test_scenarios_ask_for_what_the_paper_and_the_design_say():
    expected = {
        "circle": ((2000, 4000), (4600, 3600), (2300, 1800)),
        "forceps": ((4000, 4000), (4200, 4200), (2000, 2000)),
        "dystocia": ((2000, 4000), (4200, 4200), (2000, 2000)),
    }
    for name, (closed, first, second) in expected.items():
        rows = course(find_scenario(name).nominal()[2], [0.0, find_scenario(name).duration])
        np.testing.assert_allclose(rows[:4], [closed, closed, first, second])
    rows = course(find_scenario("circle").nominal()[2], [7.999, 8.0])
    np.testing.assert_array_equal(rows[0], (2000, 4000))


class Rising(StiffnessSchedule):
    def sample(self, time):
        rows = super().sample(time)
        rows[:2] *= 1 + time
        return rows


def test_a_users_own_schedule_is_asked_for_every_instant():
    env = gymnasium.make(CIRCLE, stiffness=Rising())
    env.reset(seed=0)
    for _ in range(10):
        info = env.step(np.zeros(4))[4]
    np.testing.assert_allclose(info["stiffness_setpoint"], 2000 * 1.1)


def test_a_coupling_of_x_and_y_is_drawn_and_reaches_info_and_reference():
    schedule = StiffnessSchedule(
        (0.0, 1.0), (3e3, 2e3), *TWO[2:], closed_loop_y=(1500.0, 1e3), closed_loop_xy=((700, 900), 0.0)
    )
    env = gymnasium.make("BirthSIM/Probe-v3", stiffness=schedule)
    _, info = env.reset(seed=0)
    coupling = float(env.unwrapped.reference.stiffness_coupling)
    assert 700 <= coupling <= 900
    for _ in range(550):
        *_, info = env.step(env.action_space.sample() * 0)
        stiffness = np.array([[3e3, coupling], [coupling, 1500.0]]) if info["time"] < 1 else np.diag([2e3, 1e3])
        given = info["compliant_target"] - info["target"]
        np.testing.assert_allclose(stiffness @ given, info["user_force"], atol=1e-9)
    assert info["user_force"][0] > 10
