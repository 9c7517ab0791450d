"""Passages: their derivatives are those of their values, and they meet both ends."""

from itertools import permutations

import numpy as np
import pytest

from birthsim_build.stages import LEAST_TIME, PACE
from birthsim_env.parts.references import Circle, Hold, Trajectory
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters
from tests.live.rig.course import Course


def differences(samples: np.ndarray, step: float) -> np.ndarray:
    return (samples[2:] - samples[:-2]) / (2 * step)


def test_a_bridge_meets_both_ends_and_its_derivatives_are_true() -> None:
    course, there, begins = Course(Circle()), np.array([0.42, 0.03]), 0.8
    before = course.sample(begins)
    course.follow(Hold(tuple(there)), begins)
    lasts = LEAST_TIME + float(np.linalg.norm(before[:2] - there)) / PACE
    offset = np.concatenate([there, np.zeros(6)])
    assert course.sample(begins) == pytest.approx(before, rel=1e-12, abs=1e-12)
    assert np.abs(course.sample(begins + lasts * (1 - 1e-9)) - offset).max() < 1e-6
    assert np.array_equal(course.sample(begins + lasts + 0.01), offset)
    step = 1e-4
    rows = np.array([course.sample(t) for t in np.arange(begins, begins + lasts, step)])
    for order in range(3):
        here, rate = rows[:, 2 * order : 2 * order + 2], rows[:, 2 * order + 2 : 2 * order + 4]
        assert np.abs(differences(here, step) - rate[1:-1]).max() < 1e-5 * np.abs(rate).max()


@pytest.mark.parametrize("after", [Hold((0.45, 0.05)), Circle(radius=0.03, period=3.0)], ids=["hold", "circle"])
def test_a_course_is_smooth_through_several_changes(after: Trajectory) -> None:
    course = Course(Circle())
    step, rows = 1e-4, []
    for k in range(7000, 25000):
        now = k * step
        if k == 8000:
            course.follow(after, now)
        if k == 12000:  # while the first bridge is still under way
            course.follow(Circle(radius=0.06), now)
        rows.append(course.sample(now))
    table = np.array(rows)
    for order in range(3):
        here, rate = table[:, 2 * order : 2 * order + 2], table[:, 2 * order + 2 : 2 * order + 4]
        # A jump of a value at a change would be step^-1 times as large as its rate.
        assert np.abs(differences(here, step) - rate[1:-1]).max() < 1e-3 * np.abs(rate).max()
    assert np.abs(np.diff(table[:, 6:8], axis=0)).max() < 0.02  # the jerk is continuous too


@pytest.mark.parametrize(("first", "second"), list(permutations(SCENARIOS, 2)))
def test_bridges_between_scenarios_stay_in_the_workspace(first: str, second: str) -> None:
    for now in (0.7, 2.9):
        course = Course(SCENARIOS[first].nominal()[0])
        course.follow(SCENARIOS[second].nominal()[0], now)
        samples = np.stack([course.sample(t)[:2] for t in np.arange(now, now + 4, 0.02)], axis=1)
        inverse_geometry(samples, Parameters())
