"""Watches a training by Stable-Baselines3: averages its policies, validates the average, checkpoints, TensorBoard, progress."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from agents.training.reached import Reached
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.checkpoint import save_checkpoint
from agents.training.sb3.model import network_of
from agents.training.time_split import split


class Monitor(BaseCallback):
    """Averages the policies and validates the average at equal intervals; then the best one and a checkpoint are on disk.

    ``stepped`` is what the training steps. A curve's ``environment_fraction`` is that of the training's time, without
    validation, and its ``split`` says where that went: on plant, law and what stands around them. ``began``, s of
    ``time.perf_counter``, is before the law was validated, which is no part of the training either.
    """

    def __init__(self, reached: Reached, folder: Path, goes_on: bool, stepped: SB3VecEnv, bar: tqdm[Any], began: float) -> None:
        super().__init__()
        self.reached, self._folder, self._stepped, self._bar = reached, folder, stepped, bar
        self._started, self._validating = began, 0.0 if goes_on else time.perf_counter() - began
        # A checkpoint is written right after a validation, which need not be repeated.
        self._goes_on, self._before = goes_on, reached.seconds

    def _on_rollout_start(self) -> None:
        # After an update and not inside a rollout: every validated policy is one that the algorithm has finished with.
        if self._goes_on:
            self._goes_on = False
            return
        self.model.average.update_parameters(self.model.policy)  # type: ignore[attr-defined]
        if self.reached.is_due(self.num_timesteps):
            self._check()

    def _on_rollout_end(self) -> None:
        self._bar.update(min(self.num_timesteps, self._bar.total) - self._bar.n)

    def _on_step(self) -> bool:
        return not self.reached.enough

    def _on_training_end(self) -> None:
        if self.reached.enough:
            return
        self.model.average.update_parameters(self.model.policy)  # type: ignore[attr-defined]
        self._check()

    def _check(self) -> None:
        began, reached = time.perf_counter(), self.reached
        model: Any = self.model
        network = network_of(model.algorithm, model.average.module, self.training_env)  # type: ignore[arg-type]
        metrics = reached.validate(network)
        self._validating += time.perf_counter() - began
        seconds = self._before + time.perf_counter() - self._started
        stepped = self._stepped
        fraction = stepped.seconds / max(time.perf_counter() - self._started - self._validating, 1e-9)
        parts = split(stepped.env.simulation, stepped.seconds / stepped.steps) if stepped.steps else {}
        about = {"steps": self.num_timesteps, "seconds": seconds, "environment_fraction": fraction, "split": parts}
        best = reached.add(network, metrics, about)
        for name, value in reached.events(metrics).items():
            self.logger.record(name, value)
        self.logger.dump(self.num_timesteps)
        self._bar.set_postfix_str(reached.words(metrics))
        save_checkpoint(self._folder, model, self.training_env, reached.describe(), reached.past())  # type: ignore[arg-type]
        if best:
            reached.keep()
