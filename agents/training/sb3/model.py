"""Models of Stable-Baselines3, all beginning with an action of zero: with a controller underneath, the controller's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv
from torch.distributions import Distribution
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from agents.training.configuration import TrainingSettings
from agents.training.sb3.algorithm import ByStableBaselines
from baselines.network import Layer, PolicyNetwork

AVERAGED = 0.05
"""Share of a training over which its policies are averaged."""


def make_model(algorithm: ByStableBaselines, settings: TrainingSettings, env: VecEnv) -> Any:
    """A model of ``algorithm``, which it names, whose mean action is zero everywhere.

    Its ``average`` is the exponential average of its policies over the last ``AVERAGED`` of the steps, as far as
    ``average.update_parameters(policy)`` is called after every update: an update may move a policy by more than is left to be
    learned. Its logger keeps what it is told, and writes it to the formats that it is given.
    """
    shared: dict[str, Any] = {
        "seed": settings.seed,
        "gamma": settings.discount,
        "batch_size": settings.batch,
        "learning_rate": _falling(settings.learning_rate),
        "device": "cpu",
    }
    model = algorithm.make(settings, env, shared)
    model.set_logger(Logger(None, []))
    algorithm.begin(model.policy, settings)
    decay = max(0.0, 1.0 - algorithm.between(settings) / (AVERAGED * settings.steps))
    averaging: Any = get_ema_multi_avg_fn(decay)  # type: ignore[no-untyped-call]
    model.algorithm, model.average = algorithm, AveragedModel(model.policy, multi_avg_fn=averaging)
    return model


@contextmanager
def unchecked_distributions() -> Iterator[None]:
    """Within it PyTorch does not check every number that a distribution gets and gives, which takes as long as computing it.

    An action that is not finite is refused by the environments.
    """
    Distribution.set_default_validate_args(False)
    try:
        yield
    finally:
        Distribution.set_default_validate_args(__debug__)  # as PyTorch begins


def network_of(algorithm: ByStableBaselines, policy: Any) -> PolicyNetwork:
    """The deterministic part of a model's policy, which takes observations as they are, as plain arrays."""

    def array(tensor: Any) -> NDArray[np.float32]:
        # A copy: the policy goes on training in its own memory.
        return np.array(tensor.detach().cpu().numpy(), dtype=np.float32, order="C")

    parts = algorithm.parts(policy)
    linear = [layer for layer in parts.inner if isinstance(layer, torch.nn.Linear)]
    layers: tuple[Layer, ...] = tuple((array(layer.weight), array(layer.bias)) for layer in [*linear, parts.last])
    unit: Any = parts.memory
    own = () if unit is None else ((unit.weight_ih_l0, unit.bias_ih_l0), (unit.weight_hh_l0, unit.bias_hh_l0))
    memory: tuple[Layer, ...] = tuple((array(weight), array(bias)) for weight, bias in own)
    inputs = policy.observation_space.shape[0]
    return PolicyNetwork(np.zeros(inputs), np.ones(inputs), layers, parts.squashed, memory)


def _falling(rate: float) -> Callable[[float], float]:
    # The last rollout may end after the last step that was asked for, so that less than nothing remains.
    return lambda remaining: rate * (0.01 + 0.99 * max(0.0, remaining))
