"""PPO of Stable-Baselines3 drives the valves, in 64 lanes; then its score on the test split, beside a controller's.

python examples/sb3_ppo.py [id] [steps] [seed] [file]      needs pip install -e '.[agents]'; 3 CPU minutes
"""

import sys

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

import birthsim
from agents import SB3VecEnv

LANES = 64


class Report(BaseCallback):
    """What the last hundred episodes were like, exploration included, every tenth rollout."""

    def _on_step(self):
        return True

    def _on_rollout_end(self):
        episodes = self.model.ep_info_buffer
        if episodes and self.num_timesteps // self.model.n_steps // LANES % 10 == 0:
            paid, length = (np.mean([one[key] for one in episodes]) for key in ("r", "l"))
            paid = birthsim.normalized_return(environment, paid)
            print(f"{self.num_timesteps:9,} steps: episodes of {length:.0f} steps, normalised return {paid:.0f}", flush=True)


if __name__ == "__main__":
    environment = sys.argv[1] if len(sys.argv) > 1 else "BirthSIM/Circle-v2"
    steps, seed = int(float(sys.argv[2])) if len(sys.argv) > 2 else 800_000, int(sys.argv[3]) if len(sys.argv) > 3 else 0
    file = sys.argv[4] if len(sys.argv) > 4 else "out/ppo.zip"
    torch.set_num_threads(1)
    worlds = gym.make_vec(environment, num_envs=LANES, randomize=True, autoreset_mode="SameStep", num_threads=1)
    model = PPO(
        "MlpPolicy", SB3VecEnv(worlds, staggered=True), n_steps=64, batch_size=512, gamma=0.96, learning_rate=1e-3, seed=seed,
        device="cpu",
    )  # fmt: skip
    model.learn(steps, callback=Report())
    model.save(file)
    print(f"written to {file}; on the test split, without exploration:")
    print(birthsim.score(file, environment))
    print(birthsim.score("backstepping", environment))
