"""Rewards less a constant, for a learner: the same problem with values near zero.

An environment that pays about one per step, so that ending early never pays, has values near 1/(1 - discount), and what one
action is worth more than another is a small difference of large ones. Less ``by`` per step all values are by/(1 - discount)
less. So is that of having terminated, which was zero: it is paid at the last step. No policy is worth more or less than
before relative to another.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper


class ShiftedReward(VecEnvWrapper):
    """``venv`` with every reward less ``by``, and ``discount`` by/(1 - discount) less where an episode terminates.

    ``infos`` stay as they are, returns of episodes too. Raises ``ValueError`` for a discount that is not in [0, 1).
    """

    def __init__(self, venv: VecEnv, by: float, discount: float) -> None:
        if not 0 <= discount < 1:
            raise ValueError(f"discount = {discount!r}; allowed: 0 or more and less than 1")
        super().__init__(venv)
        self._by, self._ended = by, discount * by / (1 - discount)

    def reset(self) -> Any:
        """As ``venv``."""
        return self.venv.reset()

    def step_wait(self) -> Any:
        """As ``venv``, with shifted rewards."""
        observations, rewards, ended, infos = self.venv.step_wait()
        terminated = np.array(ended)
        for lane in np.flatnonzero(ended):
            terminated[lane] = not infos[lane].get("TimeLimit.truncated", False)
        return observations, (rewards - self._by - self._ended * terminated).astype(np.float32), ended, infos
