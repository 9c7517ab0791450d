"""A hand of a user's own: a spring to (0.52, 0) m, in each episode of another stiffness."""

import numpy as np

from birthsim_env import UserForce


class Spring(UserForce):
    closed_loop = True

    def prepare(self, num_envs):
        self.stiffness = np.zeros(num_envs)

    def begin(self, lane, rng):
        self.stiffness[lane] = rng.uniform(200.0, 800.0)

    def force(self, time, position, velocity):
        return (self.stiffness * (np.array([[0.52], [0.0]]) - position))[None]
