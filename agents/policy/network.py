"""A trained policy as plain arrays: normalisation and a small tanh network, so that running one needs neither PyTorch nor
Stable-Baselines3.

The network is evaluated by a kernel of ours, in double precision and with a fixed order of summation: the same bits for
one lane and for many, on every processor. A library's matrix product sums in an order that depends on both.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array

Weights = NDArray[np.float32]
Statistics = NDArray[np.float64]
"""Double precision: an input that hardly varies is divided by 1e-4, and rounding its mean to singles would show."""

CLIP = 10.0
"""Bound of a normalised observation entry, as in Stable-Baselines3's VecNormalize."""

EPSILON = 1e-8


@dataclass(frozen=True)
class PolicyNetwork:
    """Deterministic part of a policy.

    ``mean`` and ``variance`` (D,) of the observations; ``layers`` are (weight (out, in), bias (out,)) pairs with tanh between
    them, and after the last one another where it is ``squashed`` (SAC, TQC), else none. Raises ``ValueError`` where shapes do
    not fit together or a number is not finite.
    """

    mean: Statistics
    variance: Statistics
    layers: tuple[tuple[Weights, Weights], ...]
    squashed: bool = False

    def __post_init__(self) -> None:
        width = self.mean.shape[0] if self.mean.ndim == 1 else -1
        if width < 1 or self.variance.shape != (width,) or not self.layers:
            raise ValueError(f"policy: mean {self.mean.shape} and variance {self.variance.shape}; allowed: both (D,)")
        for k, (weight, bias) in enumerate(self.layers):
            if weight.ndim != 2 or weight.shape[1] != width or bias.shape != (weight.shape[0],):
                raise ValueError(
                    f"policy: layer {k} has weight {weight.shape} and bias {bias.shape}; allowed: (n, {width}) and (n,)"
                )
            width = weight.shape[0]
        arrays: list[NDArray[Any]] = [self.mean, self.variance, *(array for layer in self.layers for array in layer)]
        if not all(np.isfinite(array).all() for array in arrays) or (self.variance < 0).any():
            raise ValueError("policy: some numbers are not finite or a variance is negative; allowed: finite numbers")

    @property
    def inputs(self) -> int:
        """Length of an observation."""
        return int(self.mean.shape[0])

    @property
    def outputs(self) -> int:
        """Length of an action."""
        return int(self.layers[-1][1].shape[0])

    @cached_property
    def _transposed(self) -> tuple[tuple[Weights, Weights], ...]:
        """The layers with weights (in, out), each row contiguous."""
        return tuple((np.ascontiguousarray(weight.T), bias) for weight, bias in self.layers)

    def actions(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (N, outputs) in [-1, 1] for observations (N, inputs); equal bits whatever N and the processor."""
        x = (observations - self.mean) / np.sqrt(self.variance + EPSILON)
        x = np.minimum(np.maximum(x, -CLIP), CLIP)
        for k, (weight, bias) in enumerate(self._transposed):
            y = np.empty((len(x), len(bias)))
            layer(x, weight, bias, k + 1 < len(self.layers) or self.squashed, y)
            x = y
        return np.clip(x, -1.0, 1.0).astype(np.float32)


@kernel
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
