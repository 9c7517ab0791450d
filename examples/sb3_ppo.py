"""PPO of Stable-Baselines3 with its default settings learns to drive the valves by itself; then how well, beside the laws.

python examples/sb3_ppo.py [id] [steps] [seed]             needs pip install -e '.[agents]'
"""

import sys

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy

import birthsim_env


class Report(BaseCallback):
    """What the last hundred episodes were like, after every rollout in which one has ended."""

    def _on_step(self):
        return True

    def _on_rollout_end(self):
        episodes = self.model.ep_info_buffer
        if episodes and self.n_calls % 10 == 0:
            paid, length = (np.mean([one[key] for one in episodes]) for key in ("r", "l"))
            score = birthsim_env.normalized_score(environment, paid)
            print(f"{self.num_timesteps:9,} steps: episodes of {length:.0f} steps, score {score:.0f}", flush=True)


if __name__ == "__main__":
    environment = sys.argv[1] if len(sys.argv) > 1 else "BirthSIM/Circle-v2"
    steps, seed = int(float(sys.argv[2])) if len(sys.argv) > 2 else 200_000, int(sys.argv[3]) if len(sys.argv) > 3 else 0
    torch.set_num_threads(1)
    model = PPO("MlpPolicy", gym.make(environment, randomize=True), seed=seed, device="cpu")
    model.learn(steps, callback=Report())
    worlds = gym.wrappers.RecordEpisodeStatistics(gym.make(environment, randomize=True))
    worlds.reset(seed=1000)
    returns, lengths = evaluate_policy(model, worlds, 20, return_episode_rewards=True)
    score = birthsim_env.normalized_score(environment, np.mean(returns))
    print(f"{environment}, without noise: episodes of {np.mean(lengths):.0f} steps, score {score:.0f}")
    for role, known in birthsim_env.reference_scores(environment).items():
        score = birthsim_env.normalized_score(environment, known["return"])
        print(f"{role:22} {known['controller']:28} return {known['return']:6.0f}  score {score:4.0f}")
