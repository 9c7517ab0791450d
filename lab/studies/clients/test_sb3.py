"""Stable-Baselines3 with its own tools, on single environments side by side and on the native lanes."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecNormalize

from agents import SB3VecEnv

# The module before the colon registers the ids in processes of their own too.
PROBE = "birthsim_env:BirthSIM/Probe-v3"
CIRCLE = "BirthSIM/Circle-v2"
DRAWN = {"randomize": True}


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def test_the_checker_has_nothing_to_say():
    check_env(gym.make(PROBE), warn=True)


@pytest.mark.parametrize("kind", [DummyVecEnv, SubprocVecEnv])
def test_make_vec_env_gives_what_the_bare_environments_give(kind):
    worlds = make_vec_env(PROBE, n_envs=2, seed=3, env_kwargs=DRAWN, vec_env_cls=kind)
    bare = [gym.make(PROBE, **DRAWN) for _ in range(2)]
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (30, 2, 4)).astype(np.float32)
    np.testing.assert_array_equal(worlds.reset(), [env.reset(seed=3 + k)[0] for k, env in enumerate(bare)])
    for action in actions:
        seen, paid, *_ = worlds.step(action)
        expected = [env.step(one) for env, one in zip(bare, action, strict=True)]
        np.testing.assert_array_equal(seen, [one[0] for one in expected])
        np.testing.assert_array_equal(np.float32(paid), np.float32([one[1] for one in expected]))
    worlds.close()


def test_the_native_lanes_give_what_dummy_vec_env_gives_through_an_end():
    cut = {**DRAWN, "max_episode_steps": 20}
    native = SB3VecEnv(gym.make_vec(PROBE, num_envs=2, autoreset_mode="SameStep", **cut))
    theirs = DummyVecEnv([lambda: gym.make(PROBE, **cut)] * 2)
    for worlds in (native, theirs):
        worlds.seed(3)
    np.testing.assert_array_equal(native.reset(), theirs.reset())
    ends = 0
    for action in np.random.default_rng(1).uniform(-0.3, 0.3, (50, 2, 4)).astype(np.float32):
        one, other = native.step(action), theirs.step(action)
        for k in range(3):
            np.testing.assert_array_equal(one[k], other[k])
        for ours, said in zip(one[3], other[3], strict=True):
            assert ("terminal_observation" in ours) == ("terminal_observation" in said)
            if "terminal_observation" in ours:
                ends += 1
                np.testing.assert_array_equal(ours["terminal_observation"], said["terminal_observation"])
                assert ours["TimeLimit.truncated"] == said["TimeLimit.truncated"]
    assert ends == 4


def test_vec_normalize_is_saved_and_loaded(tmp_path):
    worlds = VecNormalize(make_vec_env(PROBE, n_envs=2, seed=3, env_kwargs=DRAWN))
    worlds.reset()
    for action in np.random.default_rng(0).uniform(-0.3, 0.3, (50, 2, 4)).astype(np.float32):
        worlds.step(action)
    worlds.save(str(tmp_path / "normalize.pkl"))
    again = VecNormalize.load(str(tmp_path / "normalize.pkl"), make_vec_env(PROBE, n_envs=2, seed=9, env_kwargs=DRAWN))
    bare = make_vec_env(PROBE, n_envs=2, seed=9, env_kwargs=DRAWN).reset()
    again.training = False
    np.testing.assert_array_equal(again.reset(), worlds.normalize_obs(bare))


@pytest.mark.parametrize("algorithm", [PPO, SAC])
def test_a_saved_model_acts_as_before_and_learns_on(algorithm, tmp_path):
    settings = {"n_steps": 64} if algorithm is PPO else {"learning_starts": 50, "buffer_size": 1000}
    model = algorithm("MlpPolicy", make_vec_env(PROBE, n_envs=2, seed=0, env_kwargs=DRAWN), seed=0, device="cpu", **settings)
    model.learn(400)
    model.save(tmp_path / "model")
    env = gym.make(PROBE, **DRAWN)
    again = algorithm.load(tmp_path / "model", env=make_vec_env(PROBE, n_envs=2, seed=0, env_kwargs=DRAWN), device="cpu")
    seen = np.array([env.reset(seed=seed)[0] for seed in range(16)])
    np.testing.assert_array_equal(again.predict(seen, deterministic=True)[0], model.predict(seen, deterministic=True)[0])
    again.learn(200, reset_num_timesteps=False)
    assert again.num_timesteps >= 600
    assert not np.array_equal(again.predict(seen, deterministic=True)[0], model.predict(seen, deterministic=True)[0])


def test_ppo_learns_on_native_lanes_and_eval_callback_keeps_the_best(tmp_path, mean_return):
    lanes = SB3VecEnv(gym.make_vec(CIRCLE, num_envs=64, autoreset_mode="SameStep", **DRAWN), staggered=True)
    worlds = VecNormalize(lanes, gamma=0.96)
    watch = VecNormalize(make_vec_env(CIRCLE, n_envs=1, seed=100, env_kwargs=DRAWN), training=False, norm_reward=False)
    callback = EvalCallback(
        watch, eval_freq=800, n_eval_episodes=2, best_model_save_path=str(tmp_path), log_path=str(tmp_path), verbose=0
    )
    model = PPO("MlpPolicy", worlds, n_steps=64, batch_size=512, gamma=0.96, learning_rate=1e-3, seed=0, device="cpu")

    def policy(observation):
        return model.predict(worlds.normalize_obs(observation), deterministic=True)[0]

    untrained = mean_return(policy)
    model.learn(120_000, callback=callback)
    assert mean_return(policy) > untrained + 200, untrained
    written = np.load(tmp_path / "evaluations.npz")
    assert list(written["timesteps"]) == [51_200, 102_400]
    assert callback.best_mean_reward == pytest.approx(written["results"].mean(axis=1).max())
    best = PPO.load(tmp_path / "best_model", device="cpu")
    assert evaluate_policy(best, watch, 2)[0] > untrained + 200


def test_the_example_trains_and_prints_scores(example):
    assert example("sb3_ppo")
