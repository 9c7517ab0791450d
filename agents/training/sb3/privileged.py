"""A training of a privileged policy: its worlds tell it ``agents.residual.privileged``."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnvWrapper

from agents.residual.privileged import TRUE_PARAMETERS, true_parameters, with_true_parameters
from agents.training.sb3.adapter import SB3VecEnv


class Privileged(VecEnvWrapper):
    """``venv`` whose observations have the true parameters. The last observation of an episode has those of
    the step before."""

    def __init__(self, venv: SB3VecEnv) -> None:
        own: Any = venv.observation_space
        more = np.full(TRUE_PARAMETERS, np.inf, dtype=np.float32)
        super().__init__(venv, spaces.Box(np.append(own.low, -more), np.append(own.high, more), dtype=np.float32))
        self._lanes = venv.env

    def reset(self) -> Any:
        """As ``venv``."""
        return with_true_parameters(self._lanes, np.asarray(self.venv.reset()))

    def step_wait(self) -> Any:
        """As ``venv``."""
        before = true_parameters(self._lanes)
        observations, rewards, ended, infos = self.venv.step_wait()
        for lane in np.flatnonzero(ended):
            infos[lane]["terminal_observation"] = np.append(infos[lane]["terminal_observation"], before[lane])
        return with_true_parameters(self._lanes, np.asarray(observations)), rewards, ended, infos
