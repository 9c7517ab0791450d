"""Gymnasium: its checker, its wrappers and both of its vector environments give what the bare environment gives."""

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from moviepy import VideoFileClip

import birthsim_env
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import names

IDS = [environment_id(scenario) for scenario in names("scenario")]
STEPS = 40


def rollout(env, actions, seed=5):
    """Observations and rewards of a run, the first observation first."""
    seen, paid = [env.reset(seed=seed)[0]], []
    for action in actions:
        observation, reward, *_ = env.step(action)
        seen.append(observation), paid.append(reward)
    return np.array(seen), np.array(paid)


@pytest.fixture
def actions():
    return np.random.default_rng(0).uniform(-0.3, 0.3, (STEPS, 4)).astype(np.float32)


@pytest.fixture
def bare(actions):
    return rollout(gym.make("BirthSIM/Circle-v2", sensors="lab", randomize=True), actions)


def circle(**arguments):
    return gym.make("BirthSIM/Circle-v2", sensors="lab", randomize=True, **arguments)


@pytest.mark.parametrize("name", IDS)
def test_the_checker_has_nothing_to_say(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(name).unwrapped, skip_render_check=True)


@pytest.mark.parametrize(
    "wrap",
    [
        wrappers.ClipAction,
        wrappers.FlattenObservation,
        wrappers.PassiveEnvChecker,
        wrappers.OrderEnforcing,
        wrappers.RecordEpisodeStatistics,
        lambda env: wrappers.RescaleAction(env, np.float32(-1), np.float32(1)),
        lambda env: wrappers.DtypeObservation(env, np.float32),
        lambda env: wrappers.TimeLimit(env, STEPS + 1),
        lambda env: wrappers.TransformReward(env, lambda reward: reward),
        lambda env: wrappers.TransformObservation(env, lambda observation: observation, env.observation_space),
        lambda env: wrappers.Autoreset(env),
    ],
    ids=[
        "clip",
        "flatten",
        "checker",
        "order",
        "statistics",
        "rescale",
        "dtype",
        "limit",
        "reward",
        "observation",
        "autoreset",
    ],
)
def test_a_wrapper_that_changes_nothing_changes_no_bit(wrap, actions, bare):
    seen, paid = rollout(wrap(circle()), actions)
    np.testing.assert_array_equal(seen, bare[0])
    np.testing.assert_array_equal(paid, bare[1])


def test_wrappers_that_change_the_observation_hold_the_bare_one(actions, bare):
    stacked, _ = rollout(wrappers.FrameStackObservation(circle(), 3), actions)
    np.testing.assert_array_equal(stacked[:, -1], bare[0])
    np.testing.assert_array_equal(stacked[2:, 0], bare[0][:-2])
    # Episodes end by themselves, so that this wrapper wants a limit that says when.
    timed, _ = rollout(wrappers.TimeAwareObservation(wrappers.TimeLimit(circle(), 1600)), actions)
    np.testing.assert_array_equal(timed[:, :-1].astype(np.float32), bare[0])
    delayed, _ = rollout(wrappers.DelayObservation(circle(), 2), actions)
    np.testing.assert_array_equal(delayed[2:], bare[0][:-2])
    scaled, _ = rollout(wrappers.RescaleObservation(circle(), np.float32(-1), np.float32(1)), actions)
    space = circle().observation_space
    np.testing.assert_allclose((scaled + 1) / 2 * (space.high - space.low) + space.low, bare[0], atol=1e-5)


def test_normalised_observations_are_the_bare_ones_scaled(actions, bare):
    env = wrappers.NormalizeObservation(circle())
    rollout(env, actions)
    np.testing.assert_allclose(env.obs_rms.mean, bare[0].mean(axis=0), atol=1e-3)


def test_statistics_are_the_sum_of_rewards():
    env, total, steps, over = wrappers.RecordEpisodeStatistics(gym.make("BirthSIM/Probe-v3")), 0.0, 0, False
    env.reset(seed=1)
    while not over:
        *_, reward, terminated, truncated, info = env.step(np.zeros(4, dtype=np.float32))
        total, steps, over = total + reward, steps + 1, terminated or truncated
    assert info["episode"]["l"] == steps
    assert info["episode"]["r"] == pytest.approx(total)


def test_a_film_is_recorded_of_every_step(tmp_path):
    env = wrappers.RecordVideo(gym.make("BirthSIM/Probe-v3", render_mode="rgb_array"), str(tmp_path), disable_logger=True)
    env.reset(seed=1)
    for _ in range(20):
        env.step(np.zeros(4, dtype=np.float32))
    height, width, _ = env.unwrapped.render().shape
    env.close()
    (film,) = tmp_path.glob("*.mp4")
    with VideoFileClip(str(film)) as clip:
        assert clip.size == [width, height]
        assert round(clip.duration * clip.fps) in (20, 21)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("vector", [SyncVectorEnv, AsyncVectorEnv])
def test_both_vector_environments_run_as_the_native_one(name, vector):
    lanes, length = 3, 12

    def make():
        return gym.make(name, randomize=True, max_episode_steps=length)

    worlds = vector([make] * lanes)
    native = gym.make_vec(name, num_envs=lanes, randomize=True, max_episode_steps=length)
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (3 * length, lanes, 4)).astype(np.float32)
    try:
        assert worlds.single_observation_space == native.single_observation_space
        assert worlds.metadata["autoreset_mode"] == native.metadata["autoreset_mode"]
        np.testing.assert_array_equal(worlds.reset(seed=7)[0], native.reset(seed=7)[0])
        cuts = 0
        for action in actions:
            ours, theirs = native.step(action), worlds.step(action)
            for k in range(4):
                np.testing.assert_array_equal(ours[k], theirs[k])
            cuts += int(ours[3].any())
        assert cuts == 2
    finally:
        worlds.close()


def test_vector_wrappers_say_the_same_of_both():
    def wrapped(worlds):
        return wrappers.vector.NormalizeReward(
            wrappers.vector.NormalizeObservation(wrappers.vector.RecordEpisodeStatistics(worlds))
        )

    name, lanes = "BirthSIM/Probe-v3", 4
    native = wrapped(gym.make_vec(name, num_envs=lanes, randomize=True, max_episode_steps=30))
    theirs = wrapped(SyncVectorEnv([lambda: gym.make(name, randomize=True, max_episode_steps=30)] * lanes))
    np.testing.assert_array_equal(native.reset(seed=3)[0], theirs.reset(seed=3)[0])
    ended = 0
    for action in np.random.default_rng(2).uniform(-0.3, 0.3, (70, lanes, 4)).astype(np.float32):
        one, other = native.step(action), theirs.step(action)
        np.testing.assert_array_equal(one[0], other[0])
        np.testing.assert_array_equal(one[1], other[1])
        if "episode" in one[4]:
            ended += 1
            np.testing.assert_array_equal(one[4]["episode"]["r"], other[4]["episode"]["r"])
    assert ended == 2


def test_an_environment_is_made_again_from_its_spec(actions, bare):
    again = gym.make(gym.spec("BirthSIM/Circle-v2"), sensors="lab", randomize=True)
    np.testing.assert_array_equal(rollout(again, actions)[0], bare[0])
    np.testing.assert_array_equal(rollout(gym.make(circle().spec), actions)[0], bare[0])


def test_scores_come_with_the_wheel():
    known = birthsim_env.reference_returns("BirthSIM/Circle-v2")
    scores = [birthsim_env.normalized_return("BirthSIM/Circle-v2", one["return"]) for one in known.values()]
    assert [round(score) for score in (min(scores, key=abs), max(scores))] == [0, 100]
