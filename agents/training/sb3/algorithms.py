"""Algorithms of Stable-Baselines3 and sb3-contrib, all beginning with an action of zero: with a law underneath, the law's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecNormalize
from torch.distributions import Distribution
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from agents.policy.network import PolicyNetwork
from agents.training.configuration import TrainingSettings

BUFFER = 300_000
"""Steps that SAC and TQC remember."""


AVERAGED = 0.05
"""Share of a training over which its policies are averaged."""


def make_model(settings: TrainingSettings, env: VecNormalize, tensorboard: str | None = None) -> Any:
    """A model of ``settings.algorithm`` whose mean action is zero everywhere.

    Its ``average`` is the exponential average of its policies over the last ``AVERAGED`` of the steps, as far as
    ``average.update_parameters(policy)`` is called after every update: an update may move a policy by more than is left to be
    learned.
    """
    model = _make_model(settings, env, tensorboard)
    between = settings.lanes * (settings.rollout if settings.algorithm == "ppo" else 1)
    decay = max(0.0, 1.0 - between / (AVERAGED * settings.steps))
    averaging: Any = get_ema_multi_avg_fn(decay)  # type: ignore[no-untyped-call]
    model.average = AveragedModel(model.policy, multi_avg_fn=averaging)
    return model


def _make_model(settings: TrainingSettings, env: VecNormalize, tensorboard: str | None) -> Any:
    hidden = list(settings.hidden)
    shared: dict[str, Any] = {
        "seed": settings.seed,
        "gamma": settings.discount,
        "batch_size": settings.batch,
        "learning_rate": _falling(settings.learning_rate),
        "tensorboard_log": tensorboard,
        "device": "cpu",
    }
    policy: dict[str, Any] = {"activation_fn": torch.nn.Tanh, "log_std_init": settings.log_std}
    if settings.algorithm == "ppo":
        model: Any = PPO(
            "MlpPolicy",
            env,
            n_steps=settings.rollout,
            n_epochs=settings.epochs,
            gae_lambda=settings.gae_lambda,
            policy_kwargs={**policy, "net_arch": {"pi": hidden, "vf": hidden}},
            **shared,
        )
        # PPO's spread is a parameter of its own.
        _begin_at_zero(model.policy.action_net)
        return model
    kind = SAC if settings.algorithm == "sac" else TQC
    model = kind(
        "MlpPolicy",
        env,
        train_freq=1,
        gradient_steps=settings.gradient_steps,
        buffer_size=BUFFER,
        learning_starts=20 * settings.lanes,
        policy_kwargs={**policy, "net_arch": {"pi": hidden, "qf": [128, 128]}},
        **shared,
    )
    _begin_at_zero(model.policy.actor.mu)
    _begin_at_zero(model.policy.actor.log_std, settings.log_std)
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


def network_of(policy: Any, env: VecNormalize) -> PolicyNetwork:
    """The deterministic part of a model's policy, of whichever algorithm, with its normalisation, as plain arrays."""

    def array(tensor: Any) -> NDArray[np.float32]:
        # A copy: the policy goes on training in its own memory.
        return np.array(tensor.detach().cpu().numpy(), dtype=np.float32, order="C")

    if isinstance(policy, ActorCriticPolicy):
        inner, last, squashed = policy.mlp_extractor.policy_net, policy.action_net, False
    else:
        inner, last, squashed = policy.actor.latent_pi, policy.actor.mu, True
    linear = [layer for layer in inner if isinstance(layer, torch.nn.Linear)]
    layers = tuple((array(layer.weight), array(layer.bias)) for layer in [*linear, last])
    statistics: Any = env.obs_rms
    return PolicyNetwork(statistics.mean.copy(), statistics.var.copy(), layers, squashed)


def _falling(rate: float) -> Callable[[float], float]:
    return lambda remaining: rate * (0.01 + 0.99 * remaining)


def _begin_at_zero(layer: torch.nn.Linear, bias: float = 0.0) -> None:
    torch.nn.init.zeros_(layer.weight)
    torch.nn.init.constant_(layer.bias, bias)
