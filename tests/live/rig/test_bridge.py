"""Passages: their derivatives are those of their values, and they meet both ends."""

from itertools import permutations

import numpy as np
import pytest

from birthsim_build.stages import LEAST_TIME, PACE
from birthsim_env import Circle, FixedTarget, Parameters
from birthsim_env.parts.scenarios import find_scenario, scenarios_for
from birthsim_env.physics.linkage.geometry import inverse_geometry
from tests.live.rig.course import Course


def test_a_bridge_meets_both_ends_and_its_derivatives_are_true():
    """The second of two, while the first is under way; that nothing jumps where one begins, ``follow`` checks."""
    course, there, begins = Course(Circle()), np.array([0.42, 0.03]), 0.8
    course.follow(Circle(radius=0.06), 0.6)
    before = course.sample(begins)
    course.follow(FixedTarget(tuple(there)), begins)
    lasts = LEAST_TIME + float(np.linalg.norm(before[:2] - there)) / PACE
    offset = np.concatenate([there, np.zeros(6)])
    assert course.sample(begins) == pytest.approx(before, rel=1e-12, abs=1e-12)
    assert np.abs(course.sample(begins + lasts * (1 - 1e-9)) - offset).max() < 1e-6
    assert np.array_equal(course.sample(begins + lasts + 0.01), offset)
    step = 1e-4
    rows = np.array([course.sample(t) for t in np.arange(begins, begins + lasts, step)])
    for order in range(3):
        here, rate = rows[:, 2 * order : 2 * order + 2], rows[:, 2 * order + 2 : 2 * order + 4]
        assert np.abs((here[2:] - here[:-2]) / (2 * step) - rate[1:-1]).max() < 1e-5 * np.abs(rate).max()


@pytest.mark.parametrize(("first", "second"), list(permutations(scenarios_for(Parameters()), 2)))
def test_bridges_between_scenarios_stay_in_the_workspace(first, second):
    for now in (0.7, 2.9):
        course = Course(find_scenario(first).nominal()[0])
        course.follow(find_scenario(second).nominal()[0], now)
        samples = np.stack([course.sample(t)[:2] for t in np.arange(now, now + 4, 0.02)], axis=1)
        inverse_geometry(samples, Parameters())
