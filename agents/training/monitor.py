"""Watches a training: validation on held-out worlds against the law, the best policy, checkpoints, TensorBoard, progress."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from agents.policy.files import Policy, policy_content, save_policy
from agents.residual.privileged import acting
from agents.residual.settings import ResidualSettings
from agents.training.algorithms import network_of
from agents.training.checkpoint import save_checkpoint
from agents.training.configuration import TrainingSettings
from agents.training.sb3_adapter import SB3VecEnv
from agents.training.time_split import split
from agents.training.validation import merit, validate
from birthsim_env.physics.rig.parameters import Parameters

LOGGED = ("pooled_mm", "tail_mm", "stiffness_error_percent", "hunting_mm", "saturation_percent")
"""Figures of a validation that TensorBoard shows."""


class Monitor(BaseCallback):
    """Averages the policies and validates the average at equal intervals; then the best one and a checkpoint are on disk.

    ``env`` has the validation worlds, ``stepped`` is what the training steps; ``past`` is what an earlier monitor of the same
    training had written to its checkpoint. ``paper`` has the same worlds under the paper's law, where the training shall end
    once it is far enough below that law's error. A curve's ``environment_fraction`` is that of the training's time, without
    validation, and its ``split`` says where that went: on plant, law and what stands around them.
    """

    def __init__(
        self, settings: TrainingSettings, residual: ResidualSettings, env: Any, folder: Path, past: dict[str, Any] | None,
        stepped: SB3VecEnv, position: int = 0, paper: Any = None,
    ) -> None:  # fmt: skip
        super().__init__()
        self._settings, self._residual, self._env, self._folder = settings, residual, env, folder
        self._every = settings.steps / settings.validations
        self._stepped, self._validating = stepped, 0.0
        self._started = time.perf_counter()
        # A checkpoint is written right after a validation, which need not be repeated.
        self._goes_on = past is not None
        if past is None:
            self._reached: dict[str, Any] = {"law": _without_policy(env), "policy": None, "curve": []}
            self._reached["paper"] = _without_policy(paper) if paper is not None else None
            self._validating = time.perf_counter() - self._started
            self._due, self._best = 0.0, b""
            if self._reached["law"]["infeasible"] == env.num_envs:
                raise ValueError(
                    f"all {env.num_envs} validation worlds ask for more than the rig's strength, so that no policy could be "
                    "told from another; allowed: a stronger rig, milder randomization, or another environment"
                )
        else:
            self._reached, self._due, self._best = past["reached"], past["due"], past["best"].tobytes()
            self.keep()
        curve = self._reached["curve"]
        self._before = curve[-1]["seconds"] if curve else 0.0
        self._bar = tqdm(
            total=settings.steps, initial=curve[-1]["steps"] if curve else 0, desc=f"seed {settings.seed}", unit=" steps",
            unit_scale=True, position=position,
        )  # fmt: skip

    def _on_rollout_start(self) -> None:
        # After an update and not inside a rollout: every validated policy is one that the algorithm has finished with.
        if self._goes_on:
            self._goes_on = False
            return
        self.model.average.update_parameters(self.model.policy)  # type: ignore[attr-defined]
        if self.num_timesteps >= self._due:
            self._due = min(max(self._due, 0.0) + self._every, float(self._settings.steps))
            self._check()

    def _on_rollout_end(self) -> None:
        self._bar.update(min(self.num_timesteps, self._settings.steps) - self._bar.n)

    def _on_step(self) -> bool:
        return not self.enough

    @property
    def enough(self) -> bool:
        """Whether the best policy is as far below the paper's law as the training shall get."""
        paper, best = self._reached["paper"], self._reached["policy"]
        if paper is None or best is None:
            return False
        return bool(best["pooled_mm"] <= (1 - self._settings.until / 100) * paper["pooled_mm"])

    def _on_training_end(self) -> None:
        if self.enough:
            return
        self.model.average.update_parameters(self.model.policy)  # type: ignore[attr-defined]
        self._check()

    def _check(self) -> None:
        began = time.perf_counter()
        average: Any = self.model.average  # type: ignore[attr-defined]
        network = network_of(average.module, self.training_env)  # type: ignore[arg-type]
        score = validate(self._env, acting(network.acting(), self._env, self._settings.privileged))
        figures, law = score.to_dict(), self._reached["law"]
        self._validating += time.perf_counter() - began
        seconds = self._before + time.perf_counter() - self._started
        fraction = self._stepped.seconds / max(time.perf_counter() - self._started - self._validating, 1e-9)
        stepped = self._stepped
        parts = split(stepped.env.simulation, stepped.seconds / stepped.steps) if stepped.steps else {}
        self._reached["curve"].append(
            {"steps": self.num_timesteps, "seconds": seconds, "environment_fraction": fraction, "split": parts, **figures}
        )  # fmt: skip
        for name in LOGGED:
            if np.isfinite(figures[name]):
                self.logger.record(f"validation/{name}", figures[name])
                self.logger.record(f"validation/{name}_law", law[name])
        better = 100 * (1 - figures["pooled_mm"] / law["pooled_mm"])
        self.logger.record("validation/better_than_law_percent", better)
        self.logger.dump(self.num_timesteps)
        self._bar.set_postfix_str(f"error {score.pooled:.2f} mm, law {law['pooled_mm']:.2f} mm, {better:+.0f} % better")
        best = self._reached["policy"]
        if best is None or merit(figures) < merit(best):
            self._reached["policy"] = figures
            training = {**self._settings.to_dict(), "law": law, "reached": figures}
            self._best = policy_content(Policy(network, self._settings.environment, self._residual, training))
        # The checkpoint holds the best policy too: the file that follows is the same or is written anew after a kill.
        past = {"reached": self._reached, "due": self._due, "best": np.frombuffer(self._best, dtype=np.uint8)}
        save_checkpoint(self._folder, self.model, self.training_env, self.describe(), past)  # type: ignore[arg-type]
        if self._reached["policy"] is figures:
            self.keep()

    def keep(self) -> None:
        """Write the best policy so far."""
        save_policy(self._best, self._folder)

    def describe(self) -> dict[str, Any]:
        """The settings that a checkpoint must share."""
        return described(self._settings, self._residual, self._env.simulation.parameters)

    def close(self) -> None:
        """Finish the progress bar."""
        self._bar.close()

    def reached(self) -> dict[str, Any]:
        """Validation figures of the law and of the kept policy, and the learning curve."""
        return {"settings": self.describe(), **self._reached}


def _without_policy(env: Any) -> dict[str, float]:
    """Validation figures of the law alone: actions of zero."""
    zero = np.zeros((env.num_envs, *env.single_action_space.shape), dtype=np.float32)
    return validate(env, lambda _: zero).to_dict()


def described(settings: TrainingSettings, residual: ResidualSettings, rig: Parameters) -> dict[str, Any]:
    """All settings of a training, as JSON takes them."""
    return {**settings.to_dict(), **residual.to_dict(), "rig": rig.to_dict()}
