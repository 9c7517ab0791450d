"""skrl: PPO on the native lanes, whose Gaussian actions leave [-1, 1] unless the environment clips them."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from skrl.envs.wrappers.torch import wrap_env
from skrl.utils.runner.torch import Runner

STEPS, LANES, ROLLOUT = 6_000, 32, 64
NETWORK = [{"name": "net", "input": "OBSERVATIONS", "layers": [64, 64], "activations": "tanh"}]


def worlds(**arguments):
    return wrap_env(gym.make_vec("BirthSIM/Circle-v2", num_envs=LANES, randomize=True, **arguments))


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    return {
        "seed": 1,
        "models": {
            "separate": True,
            "policy": {"class": "GaussianMixin", "initial_log_std": -0.5, "network": NETWORK, "output": "ACTIONS"},
            "value": {"class": "DeterministicMixin", "network": NETWORK, "output": "ONE"},
        },
        "memory": {"class": "RandomMemory", "memory_size": ROLLOUT},
        "agent": {
            "class": "PPO",
            "rollouts": ROLLOUT,
            "mini_batches": 8,
            "discount_factor": 0.96,
            "experiment": {"directory": str(tmp_path_factory.mktemp("skrl")), "write_interval": 0, "checkpoint_interval": 0},
        },
        "trainer": {"class": "SequentialTrainer", "timesteps": STEPS, "headless": True, "disable_progressbar": True},
    }


def acting(agent):
    """Its mean action for one observation."""

    def act(observation):
        with torch.no_grad():
            _, told = agent.act(torch.as_tensor(observation)[None], None, timestep=STEPS, timesteps=STEPS)
        return told["mean_actions"][0].clamp(-1, 1).numpy()

    return act


def test_its_wrapper_shows_the_bare_lanes():
    told, bare = worlds(), gym.make_vec("BirthSIM/Circle-v2", num_envs=LANES, randomize=True)
    # Its wrapper resets without a seed.
    told.unwrapped.reset(seed=3), bare.reset(seed=3)
    for action in np.random.default_rng(0).uniform(-0.3, 0.3, (20, LANES, 4)).astype(np.float32):
        seen, paid, *_ = told.step(torch.as_tensor(action))
        theirs = bare.step(action)
        np.testing.assert_array_equal(seen.numpy(), theirs[0])
        np.testing.assert_allclose(paid[:, 0].numpy(), theirs[1], rtol=1e-6)


def test_ppo_learns_with_clipped_actions(settings, mean_return):
    torch.set_num_threads(1)
    runner = Runner(worlds(clip_actions=True), settings)
    runner.agent.enable_models_training_mode(False)
    untrained = mean_return(acting(runner.agent))
    runner.run("train")
    runner.agent.enable_models_training_mode(False)
    assert mean_return(acting(runner.agent)) > untrained + 200, untrained


def test_without_clipping_it_is_told_what_to_choose(settings):
    with pytest.raises(ValueError, match="clip_actions=True"):
        Runner(worlds(), settings).run("train")
