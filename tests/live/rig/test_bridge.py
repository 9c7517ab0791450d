"""Passages: their derivatives are those of their values, and they meet both ends."""

from __future__ import annotations

import numpy as np
import pytest

from birthsim_build.stages import FORCE_TIME, LEAST_TIME, PACE, SETPOINTS_TIME
from birthsim_env.parts.references import Circle, Hold, Trajectory
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.session import Session
from birthsim_live.rig.settings import default_settings
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


def test_setpoints_and_the_scenario_s_force_fade_at_minimum_jerk() -> None:
    rig = Parameters()
    one = Session(rig, default_settings(rig).model_copy(update={"scenario": "circle", "scenario_force": True}))
    one.advance(1500)  # a push is on
    push = one.lane.world.force[:, 0].copy()
    assert np.abs(push).max() > 1
    one.change({"scenario_force": False, "Kclx": 3000.0})
    rows = []
    for _ in range(101):
        one.advance(1)
        rows.append([one.lane.seen.reference.stiffness[0, 0], *one.lane.world.force[:, 0]])
    for k, (stiffness, *force) in enumerate(rows):
        u, v = (min((k + 1) * 1e-3 / lasts, 1.0) for lasts in (SETPOINTS_TIME, FORCE_TIME))
        passed, left = u**3 * (10 - 15 * u + 6 * u * u), 1 - v**3 * (10 - 15 * v + 6 * v * v)
        assert stiffness == pytest.approx(2000 + 1000 * passed, rel=1e-9)
        assert force == pytest.approx(push * left, rel=1e-9, abs=1e-9)
    assert rows[-1] == [3000.0, 0.0, 0.0]
