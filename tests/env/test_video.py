"""Frames as videos: their rate, and that none depends on those before."""

import math

import gymnasium
import numpy as np
import pytest

import birthsim_env
from birthsim_env.drawing.rendering import Renderer, Scene

RIG = birthsim_env.Parameters()


@pytest.mark.parametrize(("period", "rate"), [(0.001, 1000), (0.01, 100), (0.03, 33), (0.04, 25)])
def test_a_recording_plays_in_real_time_at_a_whole_rate(period, rate):
    single = gymnasium.make("BirthSIM/Circle-v1", policy_period=period)
    several = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=2, policy_period=period)
    for env in (single, several):
        assert env.metadata["render_fps"] == rate
        assert isinstance(env.metadata["render_fps"], int)


def test_the_window_shows_real_time_and_no_more_than_50_frames_a_second(monkeypatch):
    shown = []
    monkeypatch.setattr(Renderer, "show", lambda self, scene, rate: shown.append((scene.time, rate)))
    for period, times, rate in ((0.001, (0.0, 0.02, 0.04), 50.0), (0.01, (0.0, 0.02, 0.04), 50.0), (0.04, (0.0, 0.04), 25.0)):
        shown.clear()
        env = gymnasium.make("BirthSIM/Circle-v1", policy_period=period, render_mode="human")
        env.reset(seed=0)
        for _ in range(round(0.04 / period)):
            env.step(np.zeros(4, dtype=np.float32))
        assert shown == [pytest.approx((time, rate)) for time in times]


@pytest.mark.parametrize("size", [(640, 480), (641, 487)])
def test_a_frame_does_not_depend_on_those_before(size):
    """Only what changes is drawn anew: nothing of it may stay behind or be missing."""
    rng, renderer = np.random.default_rng(0), Renderer(RIG, *size)
    for k in range(12):
        target = rng.uniform((0.3, -0.2), (0.7, 0.2))
        scene = Scene(
            time=0.1 * k,
            piston=tuple(rng.uniform((-0.09, -0.18), (0.09, 0.18))) if k % 5 else (math.nan, 0.0),
            target=tuple(target),
            compliant_target=tuple(target + rng.normal(0, 0.03, 2)),
            user_force=tuple(rng.normal(0, 60, 2)),
            pressures=tuple(rng.uniform(1e5, 7e5, 4)),
            stiffness=(1e3 * k, 2e3),
            path=rng.uniform((0.2, -0.3), (0.9, 0.3), (k, 2)),
        )
        np.testing.assert_array_equal(renderer.frame(scene), Renderer(RIG, *size).frame(scene))
