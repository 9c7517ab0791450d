"""CleanRL's ``ppo_continuous_action.py``, the file that its package holds, on the circle; and our example in its style."""

import importlib.util
import runpy
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import torch

STEPS = 150_000


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The file's own names after a training.

    It was written for Gymnasium 0.28, where ``TransformObservation`` took two arguments. Gymnasium 1 wants the space too.
    Nothing else is mended.
    """
    file = Path(importlib.util.find_spec("cleanrl").submodule_search_locations[0]) / "ppo_continuous_action.py"
    settings = {
        "num-envs": 16,
        "num-steps": 128,
        "num-minibatches": 8,
        "gamma": 0.96,
        "learning-rate": 1e-3,
        "anneal-lr": False,
        "cuda": False,
    }
    arguments = [f"--{name}={value}" for name, value in settings.items()]
    torch.set_num_threads(1)
    with pytest.MonkeyPatch.context() as patch:
        three = gym.wrappers.TransformObservation
        patch.setattr(gym.wrappers, "TransformObservation", lambda env, change: three(env, change, env.observation_space))
        patch.setattr(
            sys, "argv", [str(file), "--env-id", "birthsim_env:BirthSIM/Circle-v2", f"--total-timesteps={STEPS}", *arguments]
        )
        patch.chdir(tmp_path_factory.mktemp("cleanrl"))
        return runpy.run_path(str(file), run_name="__main__")


def test_it_trains_all_the_steps_it_was_asked_for(trained):
    assert trained["global_step"] == STEPS // (16 * 128) * 16 * 128
    assert np.isfinite(trained["loss"].item())


def test_its_agent_is_better_than_five_untrained_ones(trained, mean_return):
    env = trained["envs"].envs[0]
    while not isinstance(env, gym.wrappers.NormalizeObservation):
        env = env.env
    mean, deviation = env.obs_rms.mean, np.sqrt(env.obs_rms.var + env.epsilon)

    def policy(agent):
        def act(observation):
            scaled = torch.as_tensor(np.clip((observation - mean) / deviation, -10, 10)).float()
            with torch.no_grad():
                return agent.actor_mean(scaled[None])[0].clamp(-1, 1).numpy()

        return act

    def untrained(seed):
        torch.manual_seed(seed)
        return trained["Agent"](trained["envs"])

    assert mean_return(policy(trained["agent"])) > max(mean_return(policy(untrained(seed))) for seed in range(5))


def test_the_example_trains_and_prints_scores(example):
    assert example("cleanrl_ppo")
