"""Worlds that PyTorch differentiates: ``loss.backward()`` goes through the closed loop of N lanes.

    worlds = Worlds(gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=256, autoreset_mode="SameStep"))
    now = worlds.reset(seed=0)
    for _ in range(10):
        now = worlds.step(now, policy(now.observation))
        loss = loss - now.reward.mean()
    loss.backward()

Gradients are those of ``birthsim_env.gradients``, one-sided at kinks. What ends an episode cuts them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import Tensor
from torch.utils.dlpack import from_dlpack


class Now(NamedTuple):
    """N lanes after a policy step: ``observation`` (N, D), ``reward`` (N,), ``motion`` (4, N) of the end effector, x, y (m),
    vx, vy (m/s), ``state`` (18, N), SI units, and ``ended`` (N,), whose lanes are at the beginning of an episode.

    ``carried`` (C, N) only hands gradients on.
    """

    carried: Tensor
    observation: Tensor
    reward: Tensor
    motion: Tensor
    state: Tensor
    ended: Tensor

    def detached(self) -> Now:
        """The same, from where gradients begin anew."""
        return Now(*(one.detach() for one in self))


class _Step(torch.autograd.Function):
    @staticmethod
    def forward(context: Any, carried: Tensor, action: Tensor, worlds: Worlds) -> tuple[Tensor, ...]:
        now = worlds.advance(worlds.array(action.detach()))
        context.back, context.array = worlds.pullback(now), worlds.array
        context.mark_non_differentiable(now.ended)
        return tuple(now)

    @staticmethod
    def backward(context: Any, *gradients: Tensor) -> tuple[Tensor, Tensor, None]:
        carried, action = context.back(*map(context.array, gradients[:5]))
        return from_dlpack(carried), from_dlpack(action), None


class Worlds:
    """The lanes of ``env``, a vector environment with same-step autoreset; ``ValueError`` where it has no gradients."""

    def __init__(self, env: Any) -> None:
        if env.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
            raise ValueError(f"env = {env!r}; allowed: one made with autoreset_mode='SameStep'")
        self.env = env.unwrapped
        self.recorder = self.env.record()
        self.array = self.recorder.arrays.from_dlpack
        """A tensor as an array of where the lanes are, without a copy."""

    def reset(self, seed: Any = None, options: dict[str, Any] | None = None) -> Now:
        """Start all lanes."""
        observation, _ = self.env.reset(seed=seed, options=options)
        return self.now(observation)

    def now(self, observation: Any) -> Now:
        """The lanes as they are, where episodes begin or go on from a state of the environment that was kept."""
        self.recorder.prepare()
        arrays, lanes = self.recorder.arrays, self.env.num_envs
        return self._now(observation, arrays.zeros(lanes), arrays.ones(lanes, dtype=np.bool_))

    def step(self, now: Now, action: Tensor) -> Now:
        """A policy step under actions (N, size) in [-1, 1]."""
        return Now(*_Step.apply(now.carried, action, self))  # type: ignore[no-untyped-call]

    def advance(self, action: Any) -> Now:
        """``step`` without gradients."""
        observation, reward, terminated, truncated, _ = self.env.step(action)
        return self._now(observation, reward, terminated | truncated)

    def pullback(self, now: Now) -> Callable[..., tuple[Any, Any]]:
        """Takes gradients to the arrays of the last step, ``now``, to what was ``carried`` and to the action."""
        back, lives = self.recorder.taken(), ~self.array(now.ended)

        def pull(carried: Any, observation: Any, reward: Any, motion: Any, state: Any) -> tuple[Any, Any]:
            late, action = back(
                carried=carried * lives,
                observation=observation * lives[:, None],
                reward=reward,
                motion=motion * lives,
                state=state * lives,
            )
            return late, action.T.astype(np.float32)

        return pull

    def _now(self, observation: Any, reward: Any, ended: Any) -> Now:
        arrays = (observation, reward, *self.recorder.reached(), ended)
        found = [from_dlpack(array) for array in arrays]
        carried = torch.zeros((len(self.recorder.carried), self.env.num_envs), dtype=torch.float64, device=found[0].device)
        return Now(carried, *found)
