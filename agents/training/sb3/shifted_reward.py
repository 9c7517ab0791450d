"""Rewards less a constant, for a learner: the same problem with values near zero.

An environment that pays about one per step has values near 1/(1 - discount), and two actions differ by little beside that. A
reward that is less by ``by`` at every step lowers all values by by/(1 - discount). The value after termination, which was zero,
has to fall by as much: the last step pays for it. So the order of policies stays as it was.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper


class ShiftedReward(VecEnvWrapper):
    """``venv`` with ``by`` subtracted from every reward; where an episode terminates, ``discount * by/(1 - discount)`` more.

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
