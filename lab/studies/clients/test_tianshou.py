"""Tianshou: PPO by its high-level interface on single environments, which it vectorises itself."""

from functools import partial

import gymnasium as gym
import numpy as np
import pytest
import torch
from tianshou.env import DummyVectorEnv, SubprocVectorEnv
from tianshou.highlevel.config import OnPolicyTrainingConfig
from tianshou.highlevel.env import EnvFactoryRegistered, VectorEnvType
from tianshou.highlevel.experiment import ExperimentConfig, PPOExperimentBuilder
from tianshou.highlevel.params.algorithm_params import PPOParams

NAME, STEPS = "birthsim_env:BirthSIM/Circle-v2", 100_000


@pytest.fixture
def world(tmp_path):
    config = ExperimentConfig(seed=1, device="cpu", watch=False, persistence_base_dir=str(tmp_path), log_file_enabled=False)
    training = OnPolicyTrainingConfig(
        max_epochs=1,
        epoch_num_steps=STEPS,
        num_training_envs=16,
        test_step_num_episodes=1,
        buffer_size=4096,
        collection_step_num_env_steps=2048,
        batch_size=256,
        update_step_num_repetitions=8,
    )
    factory = EnvFactoryRegistered(task=NAME, venv_type=VectorEnvType.DUMMY, randomize=True)
    builder = PPOExperimentBuilder(factory, config, training).with_ppo_params(PPOParams(gamma=0.96, lr=1e-3))
    builder = builder.with_actor_factory_default((64, 64), torch.nn.Tanh).with_critic_factory_default((64, 64), torch.nn.Tanh)
    return builder.build().create_experiment_world()


@pytest.mark.parametrize("kind", [DummyVectorEnv, SubprocVectorEnv])
def test_its_vector_environments_give_the_bare_lanes(kind):
    told = kind([partial(gym.make, NAME, randomize=True)] * 2)
    bare = gym.make_vec("BirthSIM/Circle-v2", num_envs=2, randomize=True)
    # Tianshou resets with the seed at once, and again when it begins.
    told.seed([7, 8]), bare.reset(seed=7)
    np.testing.assert_array_equal(told.reset()[0], bare.reset()[0])
    for action in np.random.default_rng(0).uniform(-0.3, 0.3, (20, 2, 4)).astype(np.float32):
        for ours, theirs in zip(told.step(action)[:4], bare.step(action)[:4], strict=True):
            np.testing.assert_array_equal(ours, theirs)
    told.close()


def test_ppo_learns(world, mean_return):
    torch.set_num_threads(1)
    policy = world.algorithm.policy
    policy.eval()
    untrained = mean_return(policy.compute_action)
    world.trainer.run()
    policy.eval()
    assert mean_return(policy.compute_action) > untrained + 200, untrained
