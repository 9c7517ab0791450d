"""What algorithms of Stable-Baselines3 and sb3-contrib say of themselves; PyTorch is imported when one of them learns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.training.algorithm import Algorithm, Learner

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3.networks import Parts


class ByStableBaselines(Algorithm):
    """An algorithm of Stable-Baselines3's kind, in the lanes of a single environment."""

    def learner(self, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> Learner:
        from agents.training.sb3.learner import StableBaselines

        return StableBaselines(self, settings, envs, folder)

    def between(self, settings: TrainingSettings) -> int:
        """Policy steps of all lanes from one update to the next."""
        raise NotImplementedError

    def make(self, settings: TrainingSettings, env: Any, shared: dict[str, Any]) -> Any:
        """A model in ``env``, with the arguments that all have in common."""
        raise NotImplementedError

    def parts(self, policy: Any) -> Parts:
        """What the actions of a model's policy come from."""
        raise NotImplementedError

    def begin(self, policy: Any, settings: TrainingSettings) -> None:
        """Make the mean action zero everywhere: with a controller underneath, the controller's."""
        from agents.training.sb3.networks import begin_at

        begin_at(self.parts(policy).last)

    def carried(self, model: Any) -> Any:
        """What a checkpoint holds besides weights, optimizers and counts: JSON and arrays."""
        return None

    def carry(self, model: Any, carried: Any) -> None:
        """Put back what ``carried`` gave; ``ValueError`` where it does not fit."""
        if carried is not None:
            raise ValueError("memory: there for algorithms that remember past steps, and for no others")
