"""What an algorithm is to a training: its hyperparameters, the settings that it takes, and what learns by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings
    from agents.training.watch import Watch
    from baselines.network import PolicyNetwork
    from birthsim_env.simulation import Simulation

HYPERPARAMETERS: Mapping[str, Any] = MappingProxyType(
    {
        "lanes": 256, "rollout": 16, "batch": 512, "epochs": 2, "gradient_steps": 4, "learning_rate": 1e-3, "discount": 0.96,
        "gae_lambda": 0.95, "log_std": -1.5, "hidden": (64, 64), "memory": 0,
    }
)  # fmt: skip
"""Settings that differ from algorithm to algorithm, and what they are where an algorithm says nothing: PPO's on a residual,
found by trial (`lab/studies/residual/notes.md`)."""


class Learner(Protocol):
    """What learns."""

    @property
    def steps(self) -> int:
        """Policy steps so far, of all lanes."""

    def load(self, settings: dict[str, Any]) -> dict[str, Any] | None:
        """Go on from a checkpoint of these ``settings`` and return its past; None where there is none."""

    def learn(self, watch: Watch, goes_on: bool) -> None:
        """Learn until ``watch`` says that it is over, which hears of every update; ``goes_on`` after a checkpoint."""

    def network(self) -> PolicyNetwork:
        """The policy that a validation asks, a copy."""

    def stepping(self) -> tuple[Simulation, float, int]:
        """Of an environment: its simulation, the time in its policy steps, s, and their number, since ``learn`` began."""

    def save(self, settings: dict[str, Any], past: dict[str, Any]) -> None:
        """Write a checkpoint of these ``settings`` with this ``past``, between two updates."""


class Algorithm:
    """How policies learn. A registered one says what differs from this, and imports what is slow to load when it learns."""

    hyperparameters: ClassVar[Mapping[str, Any]] = MappingProxyType({})
    """Which of ``HYPERPARAMETERS`` are others, where a training does not say."""

    takes: ClassVar[frozenset[str]] = frozenset({"privileged"})
    """Which settings that only some algorithms know (``configuration.SPECIAL``) it takes."""

    collects: ClassVar[bool] = False
    """Whether it keeps ``rollout`` steps of all lanes between two updates."""

    def defaults(self) -> dict[str, Any]:
        """The hyperparameters of a training that says none."""
        return {**HYPERPARAMETERS, **self.hyperparameters}

    def complaint(self, settings: TrainingSettings) -> str:
        """What it cannot do with settings that are each possible, with what is allowed; "" where it can."""
        return ""

    def learner(self, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> Learner:
        """What learns in the lanes of ``envs``, with its checkpoint and events in ``folder``."""
        raise NotImplementedError
