"""Recurrent PPO, SAC or TQC of Stable-Baselines3 and sb3-contrib learn in 64 lanes; then the score on the test split.

python examples/sb3_others.py ALGORITHM [id] [steps] [seed] [file]         needs pip install -e '.[agents]'

ALGORITHM is recurrent-ppo, sac or tqc. docs/how-to/sb3.md has what each reached, and in how many seconds.
"""

import sys
import time

import gymnasium as gym
import torch
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import SAC

import birthsim
from agents import SB3VecEnv

LANES = 64
ROLLOUTS = {
    "n_steps": 64,
    "batch_size": 512,
    "n_epochs": 5,
    "policy_kwargs": {"net_arch": [64], "lstm_hidden_size": 32},
}
REMEMBERED = {
    "train_freq": 1,
    "gradient_steps": 8,
    "batch_size": 256,
    "buffer_size": 300_000,
    "learning_starts": 20 * LANES,
    "tau": 0.02,
    "policy_kwargs": {"net_arch": [64, 64]},
}
"""A step of all lanes, then eight updates: one to eight policy steps. Each costs as much as hundreds of policy steps."""

ALGORITHMS = {
    "recurrent-ppo": (RecurrentPPO, "MlpLstmPolicy", ROLLOUTS, 200_000),
    "sac": (SAC, "MlpPolicy", REMEMBERED, 50_000),
    "tqc": (TQC, "MlpPolicy", REMEMBERED, 50_000),
}

if __name__ == "__main__":
    name, environment = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "BirthSIM/Circle-v2"
    algorithm, policy, settings, usual = ALGORITHMS[name]
    steps, seed = int(float(sys.argv[3])) if len(sys.argv) > 3 else usual, int(sys.argv[4]) if len(sys.argv) > 4 else 0
    file = sys.argv[5] if len(sys.argv) > 5 else f"out/{name}.zip"
    torch.set_num_threads(1)
    worlds = gym.make_vec(environment, num_envs=LANES, randomize=True, autoreset_mode="SameStep", num_threads=1)
    lanes = SB3VecEnv(worlds, staggered=True)
    model = algorithm(policy, lanes, gamma=0.96, learning_rate=1e-3, seed=seed, device="cpu", **settings)
    before = time.process_time()
    model.learn(steps)
    spent = time.process_time() - before
    model.save(file)
    print(f"{model.num_timesteps:,} steps in {spent:.0f} CPU s, {model.num_timesteps / spent:.0f} a second; on the test split:")
    print(birthsim.score(model, environment))
