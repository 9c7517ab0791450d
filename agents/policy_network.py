"""A trained policy as plain arrays: normalisation and a small tanh network, evaluated by NumPy, so that running one needs
neither PyTorch nor Stable-Baselines3."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

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

    def actions(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (N, outputs) in [-1, 1] for observations (N, inputs)."""
        x = np.clip((observations - self.mean) / np.sqrt(self.variance + EPSILON), -CLIP, CLIP).astype(np.float32)
        for weight, bias in self.layers[:-1]:
            x = np.tanh(x @ weight.T + bias)
        weight, bias = self.layers[-1]
        last = x @ weight.T + bias
        return np.asarray(np.tanh(last) if self.squashed else np.clip(last, -1.0, 1.0), dtype=np.float32)
