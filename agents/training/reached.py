"""What a training has reached: validation on held-out worlds against the law, the best policy, and when it is enough."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.files import Policy, policy_content, save_policy
from agents.residual.privileged import PolicyFunction, acting
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings
from agents.training.validation import joined, merit, validate
from baselines.network import PolicyNetwork
from birthsim_env.physics.rig.parameters import Parameters

LOGGED = ("pooled_mm", "tail_mm", "stiffness_error_percent", "hunting_mm", "saturation_percent")
"""Metrics of a validation that TensorBoard shows."""


class Reached:
    """Validates policies at equal intervals in the worlds of ``envs``, and keeps the best one in ``folder``.

    ``past`` is what an earlier one of the same training had written to its checkpoint. ``paper`` has the same worlds under the
    paper's law, where the training shall end once it is far enough below that law's error.
    """

    def __init__(
        self,
        settings: TrainingSettings,
        residual: ResidualSettings,
        envs: Sequence[Any],
        folder: Path,
        past: dict[str, Any] | None,
        paper: Sequence[Any] | None = None,
    ) -> None:
        self._settings, self._residual, self.envs, self._folder = settings, residual, envs, folder
        if past is None:
            self.metrics: dict[str, Any] = {"law": self._without_policy(envs), "policy": None, "curve": []}
            self.metrics["paper"] = self._without_policy(paper) if paper is not None else None
            self._due, self._best = 0.0, b""
            if self.metrics["law"]["infeasible"] == settings.validation_lanes:
                raise ValueError(
                    f"all {settings.validation_lanes} validation worlds ask for more than the rig's strength, so that no "
                    "policy could be told from another; allowed: a stronger rig, milder randomization, or another environment"
                )
        else:
            self.metrics, self._due, self._best = past["reached"], past["due"], past["best"].tobytes()
        self._written = False
        self.keep()

    @property
    def _validated(self) -> int:
        """Policy steps of the last policy that was validated; -1 before the first."""
        curve = self.metrics["curve"]
        return curve[-1]["steps"] if curve else -1

    def is_due(self, steps: int) -> bool:
        """Whether ``steps`` have come to the next validation."""
        return steps >= self._due and steps > self._validated

    @property
    def over(self) -> bool:
        """Whether all is learned and validated, or enough."""
        return self.enough or self._validated >= self._settings.steps

    @property
    def enough(self) -> bool:
        """Whether the best policy is as far below the paper's law as the training shall get."""
        paper, best = self.metrics["paper"], self.metrics["policy"]
        if paper is None or best is None:
            return False
        return bool(best["pooled_mm"] <= (1 - self._settings.until / 100) * paper["pooled_mm"])

    def validate(self, network: PolicyNetwork) -> dict[str, float]:
        """Metrics of a policy."""
        privileged = self._settings.privileged
        return self._metrics([(env, acting(network.acting(), env, privileged)) for env in self.envs])

    def _without_policy(self, envs: Sequence[Any]) -> dict[str, float]:
        """Metrics of the controller alone: actions of zero."""

        def zero(env: Any) -> PolicyFunction:
            return lambda seen: np.zeros((len(seen), *env.single_action_space.shape), dtype=np.float32)

        return self._metrics([(env, zero(env)) for env in envs])

    def _metrics(self, worlds: Sequence[tuple[Any, PolicyFunction]]) -> dict[str, float]:
        return joined([validate(env, act, target=self._settings.target) for env, act in worlds]).to_dict()

    def add(self, network: PolicyNetwork, metrics: dict[str, float], about: dict[str, Any]) -> None:
        """Add the validation that was due to the curve; ``keep`` writes the policy, where it is the best so far, once a
        checkpoint holds it."""
        self.metrics["curve"].append({**about, **metrics})
        every = self._settings.steps / self._settings.validations
        self._due = min(self._due + every, float(self._settings.steps))
        best = self.metrics["policy"]
        if best is not None and merit(metrics) >= merit(best):
            return
        self.metrics["policy"], self._written = metrics, False
        training = {**self._settings.to_dict(), "law": self.metrics["law"], "reached": metrics}
        self._best = policy_content(Policy(network, self._settings.environment, self._residual, training))

    def past(self) -> dict[str, Any]:
        """What a checkpoint holds of it, with the best policy: the file that follows is the same or is written anew after a
        kill."""
        return {"reached": self.metrics, "due": self._due, "best": np.frombuffer(self._best, dtype=np.uint8)}

    def keep(self) -> None:
        """Write the best policy so far, where there is one that is not written yet."""
        if self._best and not self._written:
            save_policy(self._best, self._folder)
            self._written = True

    def events(self, metrics: dict[str, float]) -> dict[str, float]:
        """What TensorBoard shows of a validation."""
        law, shown = self.metrics["law"], [name for name in LOGGED if np.isfinite(metrics[name])]
        return {
            **{f"validation/{name}": metrics[name] for name in shown},
            **{f"validation/{name}_law": law[name] for name in shown},
            "validation/better_than_law_percent": self.better(metrics),
        }

    def better(self, metrics: dict[str, float]) -> float:
        """How far a pooled error is below the law's, %."""
        return float(100 * (1 - metrics["pooled_mm"] / self.metrics["law"]["pooled_mm"]))

    def words(self, metrics: dict[str, float]) -> str:
        """A validation beside a progress bar."""
        law = self.metrics["law"]["pooled_mm"]
        return f"error {metrics['pooled_mm']:.2f} mm, law {law:.2f} mm, {self.better(metrics):+.0f} % better"

    def describe(self) -> dict[str, Any]:
        """The settings that a checkpoint must share."""
        return described(self._settings, self._residual, self.envs[0].simulation.parameters)

    def result(self) -> dict[str, Any]:
        """Validation metrics of the controller and of the kept policy, and the learning curve."""
        return {"settings": self.describe(), **self.metrics}


def described(settings: TrainingSettings, residual: ResidualSettings, rig: Parameters) -> dict[str, Any]:
    """All settings of a training, as JSON takes them."""
    return {**settings.to_dict(), **residual.to_dict(), "rig": rig.to_dict()}
