"""Algorithms that learn from what the policy itself has just done, and then forget it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from agents.training.sb3.algorithm import ByStableBaselines

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings


class OnPolicy(ByStableBaselines):
    """After every ``rollout`` steps of all lanes, ``epochs`` passes over them in minibatches of ``batch`` steps."""

    collects = True

    def between(self, settings: TrainingSettings) -> int:
        return settings.lanes * settings.rollout

    def collecting(self, settings: TrainingSettings) -> dict[str, Any]:
        """Arguments that they have in common."""
        return {"n_steps": settings.rollout, "n_epochs": settings.epochs, "gae_lambda": settings.gae_lambda}
