"""A policy with a memory for sb3-contrib's RecurrentPPO: the network that ``PolicyNetwork`` runs, instead of an LSTM.

A gated recurrent unit has one state, where an LSTM has two. The algorithm carries two, of which the second stays zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import torch
from gymnasium import spaces
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor, MlpExtractor
from stable_baselines3.common.type_aliases import Schedule
from torch import Tensor

States = tuple[Tensor, Tensor]
"""What a memory holds (1, N, H), and zeros."""


class Hidden(BaseFeaturesExtractor):
    """Layers with tanh, before the memory."""

    def __init__(self, observation_space: spaces.Box, hidden: Sequence[int]) -> None:
        super().__init__(observation_space, hidden[-1])
        widths = (observation_space.shape[0], *hidden)
        self.layers = torch.nn.Sequential(
            *(part for width, wide in pairwise(widths) for part in (torch.nn.Linear(width, wide), torch.nn.Tanh()))
        )

    def forward(self, observations: Tensor) -> Tensor:
        entered: Tensor = self.layers(observations)
        return entered


class Memory(torch.nn.Module):
    """Sequences (T, N, M) -> what entered and what is held (T, N, M + H)."""

    num_layers = 1

    def __init__(self, input_size: int, hidden_size: int) -> None:
        super().__init__()
        self.input_size, self.hidden_size = input_size, hidden_size
        self.unit = torch.nn.GRU(input_size, hidden_size)

    def forward(self, entered: Tensor, states: States) -> tuple[Tensor, States]:
        held, last = self.unit(entered, states[0])
        return torch.cat([entered, held], -1), (last, states[1])


class MemoryPolicy(RecurrentActorCriticPolicy):
    """Policy and value: each has ``hidden`` layers, a memory of ``lstm_hidden_size`` cells, and a last layer over both."""

    def __init__(
        self,
        observation_space: spaces.Box,
        action_space: spaces.Box,
        lr_schedule: Schedule,
        hidden: Sequence[int],
        lstm_hidden_size: int,
        activation_fn: type[torch.nn.Module],
        log_std_init: float,
        use_sde: bool,
    ) -> None:
        super().__init__(
            observation_space,
            action_space,
            lr_schedule,
            net_arch=[],
            activation_fn=activation_fn,
            log_std_init=log_std_init,
            use_sde=use_sde,
            features_extractor_class=Hidden,
            features_extractor_kwargs={"hidden": hidden},
            share_features_extractor=False,
            lstm_hidden_size=lstm_hidden_size,
        )
        self.lstm_actor: Any = Memory(self.features_dim, lstm_hidden_size)
        self.lstm_critic: Any = Memory(self.features_dim, lstm_hidden_size)
        optimizer: Any = self.optimizer_class
        self.optimizer = optimizer(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)

    def _build_mlp_extractor(self) -> None:
        """Nothing between the memory and the last layers."""
        self.mlp_extractor = MlpExtractor(
            self.features_dim + self.lstm_output_dim, net_arch=[], activation_fn=self.activation_fn, device=self.device
        )

    @staticmethod
    def _process_sequence(features: Tensor, lstm_states: Any, episode_starts: Tensor, lstm: Any) -> tuple[Tensor, Any]:
        """Sequences of N episodes, each in its order (N T, M), through a memory that episodes begin with zeros.

        An episode begins at the beginning of its sequence and nowhere else: RecurrentPPO's buffer cuts them there.
        """
        count = lstm_states[0].shape[1]
        goes_on = 1.0 - episode_starts.reshape(count, -1)[:, 0].reshape(1, count, 1)
        sequences = features.reshape(count, -1, lstm.input_size).swapaxes(0, 1)
        given, states = lstm(sequences, tuple(goes_on * state for state in lstm_states))
        return given.swapaxes(0, 1).flatten(0, 1), states
