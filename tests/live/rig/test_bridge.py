"""Bridges and fades: their derivatives are those of their values, and they meet both ends."""

from __future__ import annotations

import numpy as np
import pytest

from birthsim_env.parts.references import Circle, Hold, Trajectory
from birthsim_live.rig.bridge import Bridge, Course, Fade


def differences(samples: np.ndarray, step: float) -> np.ndarray:
    return (samples[2:] - samples[:-2]) / (2 * step)


def test_a_bridge_meets_both_ends_and_its_derivatives_are_true() -> None:
    rng = np.random.default_rng(3)
    offset = rng.normal(size=(8, 1)) * np.repeat([0.05, 0.1, 0.5, 3.0], 2)[:, None]
    bridge = Bridge(2.0, 1.3, offset)
    assert bridge.sample(2.0) == pytest.approx(offset, rel=1e-12)
    assert np.abs(bridge.sample(2.0 + 1.3 * (1 - 1e-9))).max() < 1e-6
    assert not bridge.sample(3.31).any()
    step = 1e-4
    rows = np.array([bridge.sample(t)[:, 0] for t in np.arange(2.0, 3.3, step)])
    for order in range(3):
        here, rate = rows[:, 2 * order : 2 * order + 2], rows[:, 2 * order + 2 : 2 * order + 4]
        assert np.abs(differences(here, step) - rate[1:-1]).max() < 1e-5 * np.abs(rate).max()


@pytest.mark.parametrize("after", [Hold((0.45, 0.05)), Circle(radius=0.03, period=3.0)], ids=["hold", "circle"])
def test_a_course_is_smooth_through_several_changes(after: Trajectory) -> None:
    course, rng = Course(Circle()), np.random.default_rng(0)
    course.prepare(1)
    course.begin(0, rng)
    step, rows = 1e-4, []
    for k in range(7000, 25000):
        now = k * step
        if k == 8000:
            course.follow(after, rng, now)
        if k == 12000:  # while the first bridge is still under way
            course.follow(Circle(radius=0.06), rng, now)
        rows.append(course.sample(np.array([now]))[:, 0])
    table = np.array(rows)
    for order in range(3):
        here, rate = table[:, 2 * order : 2 * order + 2], table[:, 2 * order + 2 : 2 * order + 4]
        # A jump of a value at a change would be step^-1 times as large as its rate.
        assert np.abs(differences(here, step) - rate[1:-1]).max() < 1e-3 * np.abs(rate).max()
    assert np.abs(np.diff(table[:, 6:8], axis=0)).max() < 0.02  # the jerk is continuous too


def test_a_fade_starts_whole_and_ends_at_zero() -> None:
    fade = Fade(1.0, 0.05, np.array([10.0, -2.0]))
    assert fade.sample(1.0)[0].tolist() == [10.0, -2.0]
    assert fade.sample(1.05)[0].tolist() == [0.0, 0.0]
    assert fade.over(1.05)
    assert not fade.over(1.04)
    values = np.array([fade.sample(t)[0] for t in np.arange(1.0, 1.05, 1e-5)])
    rates = np.array([fade.sample(t)[1] for t in np.arange(1.0, 1.05, 1e-5)])
    assert np.abs(differences(values, 1e-5) - rates[1:-1]).max() < 1e-4 * np.abs(rates).max()
