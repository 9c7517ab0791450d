"""Pieces of the networks of Stable-Baselines3's policies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import torch

from agents.training.configuration import TrainingSettings


@dataclass(frozen=True)
class Parts:
    """What the actions of a policy come from: layers with tanh between them, and the ``last`` one.

    Where it is ``squashed`` a tanh follows that. A ``memory`` stands before it, as ``PolicyNetwork`` says.
    """

    inner: Iterable[torch.nn.Module]
    last: torch.nn.Linear
    squashed: bool = False
    memory: torch.nn.GRU | None = None


def activation(settings: TrainingSettings) -> dict[str, Any]:
    """What all policies have in common: tanh, which ``PolicyNetwork`` knows, and the spread at the beginning."""
    return {"activation_fn": torch.nn.Tanh, "log_std_init": settings.log_std}


def begin_at(layer: torch.nn.Linear, bias: float = 0.0) -> None:
    """Make a layer give ``bias`` whatever enters."""
    torch.nn.init.zeros_(layer.weight)
    torch.nn.init.constant_(layer.bias, bias)
