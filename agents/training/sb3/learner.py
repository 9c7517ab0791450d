"""Learning by Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from agents.training.configuration import TrainingSettings
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.algorithm import ByStableBaselines
from agents.training.sb3.checkpoint import load_checkpoint, save_checkpoint
from agents.training.sb3.logged import Logged
from agents.training.sb3.model import make_model, network_of, unchecked_distributions
from agents.training.sb3.monitor import Monitor
from agents.training.sb3.privileged import Privileged
from agents.training.validation import training_seeds
from agents.training.watch import Watch
from baselines.network import PolicyNetwork
from birthsim_env.simulation import Simulation


class StableBaselines:
    """An algorithm in the lanes of the only one of ``envs``."""

    def __init__(self, algorithm: ByStableBaselines, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> None:
        (env,) = envs
        self._env, self._folder = SB3VecEnv(env, staggered=True), folder
        self._settings = settings
        # Neither observations nor rewards are divided by running statistics: those of a beginner, whose heads run away, stay in
        # them, and what comes later is small beside it (lab/studies/residual/notes.md).
        seen = Privileged(self._env) if settings.privileged else self._env
        self._model = make_model(algorithm, settings, seen)
        seen.seed(training_seeds(settings.seed, settings.lanes).start)

    @property
    def steps(self) -> int:
        """Policy steps so far."""
        return int(self._model.num_timesteps)

    def load(self, settings: dict[str, Any]) -> dict[str, Any] | None:
        """Go on from a checkpoint of these ``settings`` and return its past; None where there is none."""
        return load_checkpoint(self._folder, self._model, settings)

    def learn(self, watch: Watch, goes_on: bool) -> None:
        """Learn to the end."""
        self._model.logger.output_formats.append(Logged(watch.events.writer))
        with unchecked_distributions():
            self._model.learn(
                self._settings.steps - self.steps, callback=Monitor(watch, goes_on), reset_num_timesteps=not goes_on
            )

    def network(self) -> PolicyNetwork:
        """The average of the last policies."""
        return network_of(self._model.algorithm, self._model.average.module)

    def stepping(self) -> tuple[Simulation, float, int]:
        """Of the environment: its simulation, the time in its policy steps, s, and their number."""
        return self._env.env.simulation, self._env.seconds, self._env.steps

    def save(self, settings: dict[str, Any], past: dict[str, Any]) -> None:
        """Write a checkpoint of these ``settings`` with this ``past``, between two updates."""
        save_checkpoint(self._folder, self._model, settings, past)
