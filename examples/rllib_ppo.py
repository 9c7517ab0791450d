"""PPO of RLlib; it makes single environments side by side.

python examples/rllib_ppo.py [id] [steps]
needs pip install -e '.[agents]' ray dm-tree lz4 ormsgpack pyarrow pandas pydantic tensorboardX requests
"""

import sys

import gymnasium as gym
import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.tune.registry import register_env

import birthsim_env

environment = sys.argv[1] if len(sys.argv) > 1 else "BirthSIM/Circle-v2"
steps = int(float(sys.argv[2])) if len(sys.argv) > 2 else 200_000


def make(config):
    import birthsim_env  # registers the ids in the worker's process

    assert birthsim_env
    return gym.make(environment, **config)


register_env("birthsim", make)
ray.init(include_dashboard=False, log_to_driver=False)
config = (
    PPOConfig()
    .environment("birthsim", env_config={"randomize": True})
    .env_runners(num_env_runners=0, num_envs_per_env_runner=8)
    .training(gamma=0.99, lr=3e-4, train_batch_size_per_learner=4000, minibatch_size=250, num_epochs=10)
    .debugging(seed=0)
)
algorithm, done = config.build_algo(), 0
while done < steps:
    result = algorithm.train()["env_runners"]
    done = int(result["num_env_steps_sampled_lifetime"])
    if "episode_return_mean" in result:
        paid = birthsim_env.normalized_return(environment, result["episode_return_mean"])
        print(f"{done:9,} steps: episodes of {result['episode_len_mean']:.0f} steps, normalised return {paid:.0f}", flush=True)
algorithm.stop()
ray.shutdown()
