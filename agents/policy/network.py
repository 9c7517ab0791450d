"""A trained policy as plain arrays: normalisation, a small tanh network and, where it has one, a memory of what it saw. Running
one needs neither PyTorch nor Stable-Baselines3.

The network is evaluated by a kernel of ours, in double precision and with a fixed order of summation: the same bits for
one lane and for many, on every processor. A library's matrix product sums in an order that depends on both.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Mask
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

Weights = NDArray[np.float32]
Statistics = NDArray[np.float64]
"""Double precision: an input that hardly varies is divided by 1e-4, and rounding its mean to singles would show."""

CLIP = 10.0
"""Bound of a normalised observation entry, as in Stable-Baselines3's VecNormalize."""

EPSILON = 1e-8


Layer = tuple[Weights, Weights]
"""Weight (out, in) and bias (out,)."""


@dataclass(frozen=True)
class PolicyNetwork:
    """Deterministic part of a policy.

    ``mean`` and ``variance`` (D,) of the observations; ``layers`` with tanh between them, and after the last one another where
    it is ``squashed`` (SAC, TQC), else none. ``memory`` is empty, or a gated recurrent unit (Cho et al. 2014, as PyTorch has
    it) of H cells before the last layer, which then reads the M numbers that enter the memory and the H that it holds:

        r = s(Wr x + br + Vr h + cr),  z = s(Wz x + bz + Vz h + cz),  n = tanh(Wn x + bn + r (Vn h + cn)),  h' = (1 - z) n + z h

    with s(a) = 1/(1 + exp(-a)). Its two layers are W (3H, M) with b, and V (3H, H) with c; their rows are r, z and n.
    Raises ``ValueError`` where shapes or kinds of numbers do not fit together, or a number is not finite.
    """

    mean: Statistics
    variance: Statistics
    layers: tuple[Layer, ...]
    squashed: bool = False
    memory: tuple[Layer, ...] = ()

    def __post_init__(self) -> None:
        width = self.mean.shape[0] if self.mean.ndim == 1 else -1
        if width < 1 or self.variance.shape != (width,) or not self.layers:
            raise ValueError(f"policy: mean {self.mean.shape} and variance {self.variance.shape}; allowed: both (D,)")
        for k, one in enumerate(self.layers[:-1]):
            width = _outputs(f"layer {k}", one, width)
        if self.memory:
            if len(self.memory) != 2:
                raise ValueError(f"policy: a memory of {len(self.memory)} layers; allowed: none or 2")
            gates = _outputs("memory's layer of what enters", self.memory[0], width)
            if _outputs("memory's own layer", self.memory[1], gates // 3) != gates or gates % 3 or not gates:
                raise ValueError(f"policy: a memory of {gates} and {len(self.memory[1][1])} gates; allowed: 3 H for H cells")
            width += gates // 3
        _outputs("the last layer", self.layers[-1], width)
        weights = [array for one in (*self.layers, *self.memory) for array in one]
        for arrays, kind in ((weights, np.float32), ([self.mean, self.variance], np.float64)):
            # The compiled stage takes their bytes as they are.
            if any(array.dtype != kind for array in arrays):
                raise ValueError(f"policy: arrays of {[str(array.dtype) for array in arrays]}; allowed: {np.dtype(kind)}")
            if not all(np.isfinite(array).all() for array in arrays):
                raise ValueError("policy: some numbers are not finite; allowed: finite numbers")
        if (self.variance < 0).any():
            raise ValueError(f"policy: a variance is {self.variance.min()}; allowed: 0 or more")

    @property
    def inputs(self) -> int:
        """Length of an observation."""
        return int(self.mean.shape[0])

    @property
    def outputs(self) -> int:
        """Length of an action."""
        return int(self.layers[-1][1].shape[0])

    @property
    def cells(self) -> int:
        """Length of the memory; 0 without one."""
        return len(self.memory[0][1]) // 3 if self.memory else 0

    @cached_property
    def transposed(self) -> tuple[Layer, ...]:
        """``layers``, then those of ``memory``, with weights (in, out), each row contiguous."""
        return tuple((np.ascontiguousarray(weight.T), bias) for weight, bias in (*self.layers, *self.memory))

    def normalized(self, observations: NDArray[np.float32]) -> Array:
        """Observations (N, D) in standard deviations from their mean, within ``CLIP``."""
        x = (observations - self.mean) / np.sqrt(self.variance + EPSILON)
        return np.minimum(np.maximum(x, -CLIP), CLIP)

    def actions(self, observations: NDArray[np.float32], memory: Array | None = None) -> NDArray[np.float32]:
        """Actions (N, outputs) in [-1, 1] for observations (N, inputs); equal bits whatever N and the processor.

        ``memory`` (N, cells) goes on in its place; without it every lane acts as at the beginning of an episode.
        """
        x, count = self.normalized(observations), len(self.layers)
        for weight, bias in self.transposed[: count - 1]:
            x = _through(x, weight, bias, True)
        if self.memory:
            memory = np.zeros((len(x), self.cells)) if memory is None else memory
            enters, own = (_through(y, *one, False) for y, one in zip((x, memory), self.transposed[count:], strict=True))
            remember(enters, own, memory)
            x = np.concatenate([x, memory], axis=1)
        return np.clip(_through(x, *self.transposed[count - 1], self.squashed), -1.0, 1.0).astype(np.float32)

    def acting(self) -> Acting:
        """The network at the beginning of an episode in every lane."""
        return Acting(self)


class Acting:
    """Observations (N, D) of one policy step after the other -> actions (N, outputs), with what the network remembers of each
    lane. Another number of lanes begins anew."""

    def __init__(self, network: PolicyNetwork) -> None:
        self._network = network
        self._memory: Array = np.zeros((0, network.cells))

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        if len(self._memory) != len(observations):
            self._memory = np.zeros((len(observations), self._network.cells))
        return self._network.actions(observations, self._memory)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if lanes is None:
            self._memory = np.zeros((0, self._network.cells))
        elif len(self._memory):
            self._memory[lanes] = 0.0


def _outputs(name: str, one: Layer, width: int) -> int:
    """How many numbers a layer gives; ``ValueError`` where its shapes do not fit together or it does not take ``width``."""
    weight, bias = one
    if weight.ndim != 2 or weight.shape[1] != width or bias.shape != (weight.shape[0],):
        raise ValueError(f"policy: {name} has weight {weight.shape} and bias {bias.shape}; allowed: (n, {width}) and (n,)")
    return int(weight.shape[0])


def _through(x: Array, weight: Weights, bias: Weights, squashed: bool) -> Array:
    """``layer`` of inputs (N, m), with a weight (m, n): (N, n)."""
    y = np.empty((len(x), len(bias)))
    layer(x, weight, bias, squashed, y)
    return y


@helper
def layer(x: Array, weight: Weights, bias: Weights, squashed: bool, y: Array) -> None:
    """Writes x W + b, or its tanh where ``squashed``, for inputs (N, m), W (m, n) and b (n,), into ``y`` (N, n).

    The vector registers hold neighbouring outputs, so that every sum runs over its inputs in their order.
    """
    for i in range(x.shape[0]):
        for j in range(weight.shape[1]):
            y[i, j] = bias[j]
        for k in range(weight.shape[0]):
            for j in range(weight.shape[1]):
                y[i, j] += weight[k, j] * x[i, k]
        if squashed:
            for j in range(weight.shape[1]):
                y[i, j] = exact.tanh(y[i, j])


@helper
def remember(enters: Array, own: Array, memory: Array) -> None:
    """One step of a gated recurrent unit: ``memory`` h (N, H) goes on, with W x + b and V h + c, both (N, 3H)."""
    cells = memory.shape[1]
    for i in range(memory.shape[0]):
        for j in range(cells):
            # 1/(1 + exp(-a)) = (1 + tanh(a/2))/2, which has no branches.
            reset = 0.5 + 0.5 * exact.tanh(0.5 * (enters[i, j] + own[i, j]))
            kept = 0.5 + 0.5 * exact.tanh(0.5 * (enters[i, cells + j] + own[i, cells + j]))
            new = exact.tanh(enters[i, 2 * cells + j] + reset * own[i, 2 * cells + j])
            memory[i, j] = (1.0 - kept) * new + kept * memory[i, j]
