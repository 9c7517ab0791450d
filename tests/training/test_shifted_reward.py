"""A learner's shifted rewards are the same problem: however an episode ends, its discounted value is less by the same."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3.common.vec_env import DummyVecEnv

from agents.training.sb3_adapter import SB3VecEnv
from agents.training.shifted_reward import ShiftedReward

EPISODES = [([1.0, 0.5, 0.25], False), ([0.25], False), ([0.0] * 40, False), ([1.0, 0.75, 0.5], True)]
"""Rewards, and whether the end is one of time, after which the last value goes on."""


class Told(gymnasium.Env):
    """Pays what it is told."""

    observation_space = action_space = spaces.Box(-1, 1, (1,))

    def __init__(self, rewards, truncated):
        self.rewards, self.truncated, self.steps = rewards, truncated, 0

    def reset(self, *, seed=None, options=None):
        self.steps = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.steps += 1
        ended = self.steps == len(self.rewards)
        paid = self.rewards[self.steps - 1]
        return np.zeros(1, np.float32), paid, ended and not self.truncated, ended and self.truncated, {}


def told(rewards, truncated):
    return DummyVecEnv([lambda: Told(rewards, truncated)])


@pytest.mark.parametrize("discount", [0.9, 0.96, 0.999])
@pytest.mark.parametrize(("rewards", "truncated"), EPISODES)
def test_every_value_is_less_by_the_same(rewards, truncated, discount):
    env = ShiftedReward(told(rewards, truncated), 0.5, discount)
    env.reset()
    paid = [float(env.step(np.zeros((1, 1)))[1][0]) for _ in rewards]
    weights = discount ** np.arange(len(rewards))
    less = 0.5 / (1 - discount)
    # After an end of time a learner goes on with its own estimate, which is shifted as all values are.
    beyond = -less * discount ** len(rewards) if truncated else 0.0
    assert weights @ paid + beyond == pytest.approx(weights @ rewards - less, rel=1e-5)


def test_survival_is_what_is_taken_off():
    env = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=3, autoreset_mode="SameStep")
    shifted = ShiftedReward(SB3VecEnv(env), 1.0, 0.96)
    shifted.seed(0)
    shifted.reset()
    slam = np.tile(np.array([1, -1, 1, -1], np.float32), (3, 1))
    ended = np.zeros(3, dtype=bool)
    while not ended.any():
        _, paid, ended, infos = shifted.step(slam)
        assert (paid[~ended] <= 0).all()
        assert (paid[~ended] > -1).all()
    assert (paid[ended] < -24).all()
    assert all(info["episode"]["r"] > 0 for info in infos if info)
