"""Worlds that JAX differentiates: ``jax.grad`` goes through the closed loop of N lanes, also under ``jax.jit``.

    worlds = Worlds(gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=256, autoreset_mode="SameStep"))
    start = worlds.reset(seed=0)

    def loss(weights):
        now, total = start, 0.0
        for _ in range(10):
            now = worlds.step(now, policy(weights, now.observation))
            total -= now.reward.mean()
        return total

    gradient = jax.grad(loss)(weights)

A step is a pure callback: from one ``start`` the same actions give the same. Lanes cannot be mapped (``jax.vmap``): they are N.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import Array
from jax.dtypes import canonicalize_dtype

from agents.gradients import rollouts


class Now(NamedTuple):
    """As ``rollouts.Now``; ``at`` is the number of steps since ``Worlds.reset`` or ``begin``."""

    at: Array
    carried: Array
    observation: Array
    reward: Array
    motion: Array
    state: Array
    ended: Array


class Worlds:
    """The lanes of ``env``, a vector environment with same-step autoreset; ``ValueError`` where it has no gradients."""

    def __init__(self, env: Any) -> None:
        self.torch = rollouts.Worlds(env)

    def reset(self, seed: Any = None, options: dict[str, Any] | None = None) -> Now:
        """Start all lanes."""
        now = _arrays(self.torch.reset(seed, options), 0)
        self.shape = jax.tree.map(lambda one: jax.ShapeDtypeStruct(one.shape, one.dtype), now)
        return self.begin(now)

    def begin(self, now: Now) -> Now:
        """The lanes as they are ``now``, after the last step: from here others go on, and what led here is forgotten."""
        self._start, self._taken = self.torch.env.get_state(), list[tuple[Any, Now, Any]]()
        return Now(*map(jax.numpy.asarray, now._replace(at=np.int32(0))))

    def step(self, now: Now, action: Array) -> Now:
        """A policy step under actions (N, size) in [-1, 1]."""
        return Now(*_step(self, now.at, now.carried, action))

    def advance(self, at: Any, carried: Any, action: Any) -> Now:
        """The step after the first ``at`` ones; with other actions than before, lanes go the way to it anew."""
        before, chosen = [one for one, _, _ in self._taken], np.array(action)
        if not (at < len(before) and np.array_equal(before[at], chosen)):
            if at < len(before):
                self.torch.env.set_state(self._start)
                self._taken = []
            for one in (*before[len(self._taken) : at], chosen):
                now = self.torch.advance(one)
                self._taken.append((one, _arrays(now, len(self._taken) + 1), self.torch.pullback(now)))
        return self._taken[int(at)][1]

    def back(self, at: Any, *gradients: Any) -> tuple[Any, ...]:
        """Gradients to ``carried`` and actions of the step that led to ``at``."""
        found = self._taken[int(at) - 1][2](*map(np.asarray, gradients))
        return tuple(one.astype(canonicalize_dtype(one.dtype)) for one in found)


def _arrays(now: rollouts.Now, at: int) -> Now:
    arrays = (one.numpy() for one in now)
    return Now(np.int32(at), *(one.astype(canonicalize_dtype(one.dtype)) for one in arrays))


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _step(worlds: Worlds, at: Array, carried: Array, action: Array) -> Any:
    return jax.pure_callback(worlds.advance, worlds.shape, at, carried, action)


def _forward(worlds: Worlds, at: Array, carried: Array, action: Array) -> tuple[Any, tuple[Array, ...]]:
    now = _step(worlds, at, carried, action)
    return now, (now.at, carried, action)  # the way back waits for the step


def _backward(worlds: Worlds, kept: tuple[Array, ...], bars: Now) -> tuple[Any, ...]:
    at, *given = kept
    return None, *jax.pure_callback(worlds.back, tuple(given), at, *bars[1:6])


_step.defvjp(_forward, _backward)
