"""A policy as ``PolicyNetwork`` runs it, which PyTorch differentiates."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor

from baselines.network import Layer, PolicyNetwork, Statistics


class Differentiated(torch.nn.Module):
    """``hidden`` layers with tanh, a gated recurrent unit of ``cells`` where there are any, a last layer over what enters the
    memory and what it holds, and a tanh after that where it is ``squashed``.

    It begins with actions of zero.
    """

    def __init__(self, inputs: int, outputs: int, hidden: Sequence[int], cells: int, squashed: bool) -> None:
        super().__init__()
        self.cells, self.squashed = cells, squashed
        self.hidden = torch.nn.ModuleList(torch.nn.Linear(width, wide) for width, wide in pairwise((inputs, *hidden)))
        self.memory = torch.nn.GRU(hidden[-1], cells) if cells else None
        self.last = torch.nn.Linear(hidden[-1] + cells, outputs)
        torch.nn.init.zeros_(self.last.weight)
        torch.nn.init.zeros_(self.last.bias)

    def forward(self, seen: Tensor, held: Tensor) -> tuple[Tensor, Tensor]:
        """Actions (T, N, outputs) for normalised observations (T, N, inputs), and what the memory holds then (N, cells).

        It begins with what it has ``held`` (N, cells); zeros begin an episode.
        """
        for layer in self.hidden:
            seen = torch.tanh(layer(seen))
        if self.memory is not None:
            remembered, last = self.memory(seen, held[None])
            seen, held = torch.cat([seen, remembered], -1), last[0]
        actions = self.last(seen)
        return torch.tanh(actions) if self.squashed else actions, held

    def network(self, mean: Statistics, variance: Statistics) -> PolicyNetwork:
        """The policy as plain arrays, a copy, for observations of this ``mean`` and ``variance`` (D,)."""
        arrays = {name: value.numpy().copy() for name, value in self.state_dict().items()}

        def layer(name: str, end: str = "") -> Layer:
            return arrays[f"{name}weight{end}"], arrays[f"{name}bias{end}"]

        layers = (*(layer(f"hidden.{k}.") for k in range(len(self.hidden))), layer("last."))
        memory = (layer("memory.", "_ih_l0"), layer("memory.", "_hh_l0")) if self.cells else ()
        return PolicyNetwork(mean, variance, layers, self.squashed, memory)
