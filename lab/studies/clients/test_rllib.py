"""RLlib of plain ray: PPO learns on the circle, its checkpoint acts as the algorithm did, and our example runs."""

import gymnasium as gym
import numpy as np
import pytest
import ray
import torch
from ray.rllib.algorithms.algorithm import Algorithm
from ray.rllib.algorithms.ppo import PPOConfig

# The module before the colon registers the ids in processes of their own too.
CIRCLE = "birthsim_env:BirthSIM/Circle-v2"


@pytest.fixture(scope="module", autouse=True)
def _cluster():
    torch.set_num_threads(1)
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def config(runners, lanes):
    return (
        PPOConfig()
        .environment(CIRCLE, env_config={"randomize": True})
        .env_runners(num_env_runners=runners, num_envs_per_env_runner=lanes)
        .training(gamma=0.96, lr=1e-3, train_batch_size_per_learner=4096, minibatch_size=512, num_epochs=10)
        .debugging(seed=0)
    )


def policy(algorithm):
    module = algorithm.get_module()

    def act(observation):
        with torch.no_grad():
            out = module.forward_inference({"obs": torch.as_tensor(observation)[None]})["action_dist_inputs"]
        return np.clip(out[0, :4].numpy(), -1, 1)

    return act


def test_ppo_learns_and_its_checkpoint_acts_as_it_did(tmp_path, mean_return):
    algorithm = config(0, 8).build_algo()
    untrained = mean_return(policy(algorithm))
    for _ in range(20):
        algorithm.train()
    trained = mean_return(policy(algorithm))
    assert trained > untrained + 200, (untrained, trained)
    path = algorithm.save_to_path(tmp_path / "checkpoint")
    again = Algorithm.from_checkpoint(path)
    env = gym.make(CIRCLE, randomize=True)
    for seed in range(8):
        seen = env.reset(seed=seed)[0]
        np.testing.assert_array_equal(policy(again)(seen), policy(algorithm)(seen))
    again.stop()
    algorithm.stop()


def test_a_runner_in_its_own_process_brings_episodes():
    algorithm = config(1, 4).build_algo()
    result = algorithm.train()["env_runners"]
    algorithm.stop()
    assert result["num_env_steps_sampled_lifetime"] >= 4096


def test_the_example_trains_and_prints_scores(example):
    assert example("rllib_ppo")
