"""Frames as videos: Gymnasium's recorders take them, and what they write shows what was drawn."""

import math

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo
from imageio_ffmpeg import read_frames

import birthsim_env
from birthsim_env.drawing.rendering import Renderer, Scene

# moviepy leaves the pipes to its encoder to the garbage collector.
pytestmark = pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
RIG = birthsim_env.Parameters()
STEPS, SIZE = 20, (320, 240)


def frames_of(path):
    """Frames (T, H, W, 3) and rate of a video file."""
    reader = read_frames(str(path))
    about = next(reader)
    width, height = about["size"]
    return np.stack([np.frombuffer(frame, dtype=np.uint8).reshape(height, width, 3) for frame in reader]), about["fps"]


@pytest.mark.slow
def test_record_video_writes_what_was_drawn_at_the_rate_of_the_environment(tmp_path):
    pictures = {"render_mode": "rgb_array", "picture_size": SIZE}
    env = gymnasium.make("BirthSIM/Forceps-v1", policy_period=0.02, max_episode_steps=STEPS, **pictures)
    env = RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda episode: True, name_prefix="pull")
    drawn = []
    for episode in range(2):
        env.reset(seed=episode)
        drawn.append(env.render())
        for _ in range(STEPS):
            env.step(np.array([-0.2, 0.2, 0.3, -0.3], dtype=np.float32))
            drawn.append(env.render())
    env.close()
    assert sorted(path.name for path in (tmp_path / "videos").iterdir()) == ["pull-episode-0.mp4", "pull-episode-1.mp4"]
    for episode in range(2):
        frames, rate = frames_of(tmp_path / "videos" / f"pull-episode-{episode}.mp4")
        assert (frames.shape, rate) == ((STEPS + 1, *SIZE[::-1], 3), 50)
        # The codec loses some colour at edges, nothing in the mean.
        wanted = np.stack(drawn[(STEPS + 1) * episode :][: STEPS + 1])
        assert np.abs(frames.astype(float) - wanted).mean() < 4.0
        assert np.abs(frames.astype(float) - wanted[::-1]).mean() > 1.1 * np.abs(frames.astype(float) - wanted).mean()


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
