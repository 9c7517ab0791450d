"""Learning by Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stable_baselines3.common.vec_env import VecNormalize

from agents.training.configuration import TrainingSettings
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.algorithm import ByStableBaselines
from agents.training.sb3.checkpoint import load_checkpoint, save_checkpoint
from agents.training.sb3.logged import Logged
from agents.training.sb3.model import make_model, network_of, unchecked_distributions
from agents.training.sb3.monitor import Monitor
from agents.training.sb3.privileged import Privileged
from agents.training.sb3.shifted_reward import ShiftedReward
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
        seen = Privileged(self._env) if settings.privileged else self._env
        # Survival is paid one per 10 ms; without a discount below one there is no value to shift.
        simulation = env.unwrapped.simulation
        per_step = simulation.periods * simulation.period / 0.01
        paid = ShiftedReward(seen, per_step, settings.discount) if settings.discount < 1 else seen
        self._normalized = VecNormalize(paid, gamma=settings.discount)
        self._model = make_model(algorithm, settings, self._normalized)
        self._normalized.seed(training_seeds(settings.seed, settings.lanes).start)

    @property
    def steps(self) -> int:
        """Policy steps so far."""
        return int(self._model.num_timesteps)

    def load(self, settings: dict[str, Any]) -> dict[str, Any] | None:
        """Go on from a checkpoint of these ``settings`` and return its past; None where there is none."""
        return load_checkpoint(self._folder, self._model, self._normalized, settings)

    def learn(self, watch: Watch, goes_on: bool) -> None:
        """Learn to the end."""
        self._model.logger.output_formats.append(Logged(watch.events.writer))
        with unchecked_distributions():
            self._model.learn(
                self._settings.steps - self.steps, callback=Monitor(watch, goes_on), reset_num_timesteps=not goes_on
            )

    def network(self) -> PolicyNetwork:
        """The average of the last policies."""
        return network_of(self._model.algorithm, self._model.average.module, self._normalized)

    def stepping(self) -> tuple[Simulation, float, int]:
        """Of the environment: its simulation, the time in its policy steps, s, and their number."""
        return self._env.env.simulation, self._env.seconds, self._env.steps

    def save(self, settings: dict[str, Any], past: dict[str, Any]) -> None:
        """Write a checkpoint of these ``settings`` with this ``past``, between two updates."""
        save_checkpoint(self._folder, self._model, self._normalized, settings, past)
