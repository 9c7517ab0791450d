"""An own reward on lanes: how near the end effector is to the compliant target, whatever the valves do for it.

python examples/own_reward.py [steps] [file]               needs pip install -e '.[agents]'; birthsim.score does not use it
"""

import sys

import gymnasium as gym
import numpy as np
from stable_baselines3 import PPO

import birthsim
from agents import SB3VecEnv


class Near(gym.vector.VectorWrapper):
    """Pays 1 on the target, 1/e at a distance of 2 mm."""

    def step(self, actions):
        observations, _, terminated, truncated, infos = self.env.step(actions)
        told = infos.get("final_info", infos)  # of all lanes, before those that ended began anew
        distance = np.hypot(*told["tracking_error"].T)  # m
        return observations, np.exp(-distance / 0.002), terminated, truncated, infos


if __name__ == "__main__":
    worlds = Near(gym.make_vec("BirthSIM/Circle-v2", num_envs=64, randomize=True, autoreset_mode="SameStep"))
    model = PPO("MlpPolicy", SB3VecEnv(worlds, staggered=True), n_steps=64, batch_size=512, gamma=0.96, device="cpu")
    model.learn(int(float(sys.argv[1])) if len(sys.argv) > 1 else 800_000)
    model.save(sys.argv[2] if len(sys.argv) > 2 else "out/near.zip")
    print(birthsim.score(model, "BirthSIM/Circle-v2"))
