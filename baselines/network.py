"""A trained policy as plain arrays: normalisation, a small tanh network and, where it has one, a memory of what it saw. Running
one needs neither PyTorch nor Stable-Baselines3.

The network is evaluated by a kernel of ours, in double precision and with a fixed order of summation: the same bits for
one lane and for many, on every processor. A library's matrix product sums in an order that depends on both.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Mask
from birthsim_env.loop.stage import described, singles, singles1, table1
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array

Weights = NDArray[np.float32]
Statistics = NDArray[np.float64]
"""Double precision: an input that hardly varies is divided by 1e-4, and rounding its mean to singles would show."""

CLIP = 10.0
"""Bound of a normalised observation entry, as in Stable-Baselines3's VecNormalize."""

EPSILON = 1e-8


ONE, OTHER, ENTERS, HOLDS = range(4)
"""What stands in ``PolicyNetwork.room``: activations of two layers in turns, and what enters a memory and what it holds."""

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

    @cached_property
    def tables(self) -> tuple[NDArray[Any], ...]:
        """What ``answer`` reads: means and standard deviations (D,), then weight (in, out) and bias (out,) of each layer,
        those of the memory last."""
        layers = (array for weight, bias in self.transposed for array in (weight, bias.copy()))
        return self.mean, np.sqrt(self.variance + EPSILON), *layers

    def room(self, lanes: int) -> Array:
        """Room for the activations of ``lanes`` lanes, (2, N, W), with a memory (4, N, W)."""
        widest = max(self.inputs, *(max(weight.shape) for weight, _ in self.transposed))
        return np.zeros((4 if self.memory else 2, lanes, widest))

    def actions(self, observations: NDArray[np.float32], memory: Array | None = None) -> NDArray[np.float32]:
        """Actions (N, outputs) in [-1, 1] for observations (N, inputs); equal bits whatever N and the processor.

        ``memory`` (N, cells) goes on in its place; without it every lane acts as at the beginning of an episode.
        """
        lanes, about = len(observations), described(self.tables)
        memory = np.zeros((lanes, self.cells)) if memory is None else memory
        actions = np.empty((lanes, self.outputs), dtype=np.float32)
        _answer(about.ctypes.data, len(self.layers), self.squashed, observations, self.room(lanes), memory, actions)
        return actions

    def acting(self) -> "Acting":
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


@helper
def answer(
    tables: int, layers: int, squashed: bool, observed: NDArray[np.float32], space: Array, own: Array, actions: Any
) -> None:
    """Writes ``actions`` (N, outputs) for observations (N, inputs); ``space`` is ``PolicyNetwork.room``, and the memory ``own``
    (N, cells) goes on. ``tables`` is the address of the description of ``PolicyNetwork.tables``."""
    mean, deviation, last, cells = table1(tables, 0), table1(tables, 1), layers - 1, own.shape[1]
    x, y = space[ONE], space[OTHER]
    for i in range(observed.shape[0]):
        for k in range(mean.shape[0]):
            x[i, k] = min(max((observed[i, k] - mean[k]) / deviation[k], -CLIP), CLIP)
    for k in range(last):
        _through(tables, k, True, x, y)
        x, y = y, x
    if cells > 0:
        enters, holds = space[ENTERS], space[HOLDS]
        _through(tables, layers, False, x, enters)
        _through(tables, layers + 1, False, own, holds)
        remember(enters, holds, own)
        width = singles(tables, 2 + 2 * layers).shape[0]
        for i in range(own.shape[0]):
            for k in range(cells):
                x[i, width + k] = own[i, k]
    _through(tables, last, squashed, x, y)
    for i in range(actions.shape[0]):
        for k in range(actions.shape[1]):
            actions[i, k] = np.float32(min(max(y[i, k], -1.0), 1.0))


@helper
def _through(tables: int, k: int, squashed: bool, x: Array, y: Array) -> None:
    """The first numbers of ``x`` (N, W), through the ``k``-th layer of the tables, become the first of ``y`` (N, W)."""
    weight, bias = singles(tables, 2 + 2 * k), singles1(tables, 3 + 2 * k)
    layer(x[:, : weight.shape[0]], weight, bias, squashed, y[:, : weight.shape[1]])


@kernel
def _answer(
    tables: int, layers: int, squashed: bool, observed: NDArray[np.float32], space: Array, own: Array, actions: Any
) -> None:
    answer(tables, layers, squashed, observed, space, own, actions)
