"""The random streams of many lanes at once: what NumPy's generators give lane by lane, to the last bit.

A lane's stream is PCG64 (O'Neill 2014: 128-bit congruential steps, "XSL RR" output), seeded by NumPy's ``SeedSequence``
(after O'Neill's ``seed_seq``). NumPy promises that neither changes. Its own ``Generator`` takes 30 us to make.
"""

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.drawn.seeding import STREAMS, served, stream
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array

Words = NDArray[np.uint32]
States = NDArray[np.uint64]

POOL = 4
"""32-bit words of entropy that a ``SeedSequence`` keeps."""

HIGH, LOW, STEP_HIGH, STEP_LOW, SPARE = range(5)
"""Rows of the state (5, N): the 128-bit number, the increment, and half a draw that waits, with bit 32 set."""


def _powers(first: int, factor: int, count: int) -> Words:
    return np.array([first * pow(factor, k, 2**32) % 2**32 for k in range(count)], dtype=np.uint32)


_INTO = _powers(0x43B0D7E5, 0x931E8875, 4 * POOL + 2 * POOL + 1)
_OUT_OF = _powers(0x8B51F9DD, 0x58F38DED, 2 * POOL + 1)
"""The constants with which words are hashed into the pool and out of it, in the order of their use."""

_FACTOR_HIGH, _FACTOR_LOW = np.uint64(0x2360ED051FC65DA4), np.uint64(0x4385DF649FCCF645)
_HALF = np.uint64(0xFFFFFFFF)
_WAITS = np.uint64(1 << 32)


@helper
def _hashed(word: np.uint32, before: np.uint32, after: np.uint32) -> np.uint32:
    value = np.uint32(np.uint32(word ^ before) * after)
    return np.uint32(value ^ (value >> np.uint32(16)))


@helper
def _mixed(one: np.uint32, other: np.uint32) -> np.uint32:
    value = np.uint32(np.uint32(0xCA01F9DD) * one - np.uint32(0x4973F715) * other)
    return np.uint32(value ^ (value >> np.uint32(16)))


@helper
def _product_high(a: np.uint64, b: np.uint64) -> np.uint64:
    """The upper 64 bits of a 64-bit product."""
    shift = np.uint64(32)
    a_high, a_low, b_high, b_low = a >> shift, a & _HALF, b >> shift, b & _HALF
    middle = a_high * b_low + ((a_low * b_low) >> shift)
    other = a_low * b_high + (middle & _HALF)
    return a_high * b_high + (middle >> shift) + (other >> shift)


@helper
def _advance(state: States, i: int) -> None:
    """One congruential step of lane ``i``, modulo 2^128."""
    high, low = state[HIGH, i], state[LOW, i]
    product = low * _FACTOR_LOW
    carried = _product_high(low, _FACTOR_LOW) + high * _FACTOR_LOW + low * _FACTOR_HIGH
    state[LOW, i] = product + state[STEP_LOW, i]
    state[HIGH, i] = carried + state[STEP_HIGH, i] + (np.uint64(1) if state[LOW, i] < product else np.uint64(0))


@helper
def next64(state: States, i: int) -> np.uint64:
    """64 random bits of lane ``i``."""
    _advance(state, i)
    word, turn = state[HIGH, i] ^ state[LOW, i], state[HIGH, i] >> np.uint64(58)
    return np.uint64((word >> turn) | (word << ((np.uint64(64) - turn) & np.uint64(63))))


@helper
def _next32(state: States, i: int) -> np.uint64:
    """The lower half of 64 bits, and the next time their upper half."""
    if state[SPARE, i] != np.uint64(0):
        waiting = np.uint64(state[SPARE, i] & _HALF)
        state[SPARE, i] = np.uint64(0)
        return waiting
    word = next64(state, i)
    state[SPARE, i] = _WAITS | (word >> np.uint64(32))
    return word & _HALF


@helper
def seed(words: Words, pool: Words, drawn: Words, state: States, lanes: int) -> None:
    """Fills ``state`` (5, N) from the entropy ``words`` (W, N), W >= 4, as ``SeedSequence`` and ``PCG64`` do.

    ``pool`` (POOL, N) and ``drawn`` (2 POOL, N) are scratch."""
    used = 0
    for k in range(POOL):
        for i in range(lanes):
            pool[k, i] = _hashed(words[k, i], _INTO[used], _INTO[used + 1])
        used += 1
    for k in range(words.shape[0]):
        for into in range(POOL):
            # The pool first stirs itself; later words come to it.
            if k != into:
                for i in range(lanes):
                    word = pool[k, i] if k < POOL else words[k, i]
                    pool[into, i] = _mixed(pool[into, i], _hashed(word, _INTO[used], _INTO[used + 1]))
                used += 1
    for k in range(2 * POOL):
        for i in range(lanes):
            drawn[k, i] = _hashed(pool[k % POOL, i], _OUT_OF[k], _OUT_OF[k + 1])
    for i in range(lanes):
        high, low = _joined(drawn, 0, i), _joined(drawn, 2, i)
        step_high, step_low = _joined(drawn, 4, i), _joined(drawn, 6, i)
        # The increment is odd.
        state[STEP_HIGH, i] = (step_high << np.uint64(1)) | (step_low >> np.uint64(63))
        state[STEP_LOW, i] = (step_low << np.uint64(1)) | np.uint64(1)
        state[LOW, i] = state[STEP_LOW, i] + low
        state[HIGH, i] = state[STEP_HIGH, i] + high + (np.uint64(1) if state[LOW, i] < low else np.uint64(0))
        state[SPARE, i] = np.uint64(0)
        _advance(state, i)


@kernel
def _seed(words: Words, state: States) -> None:
    lanes = words.shape[1]
    pool, drawn = np.empty((POOL, lanes), dtype=np.uint32), np.empty((2 * POOL, lanes), dtype=np.uint32)
    seed(words, pool, drawn, state, lanes)


@helper
def _joined(words: Words, k: int, i: int) -> np.uint64:
    """Two words as one of 64 bits, the lower first."""
    return np.uint64(words[k, i]) | (np.uint64(words[k + 1, i]) << np.uint64(32))


@helper
def fraction(state: States, i: int) -> float:
    """A number in [0, 1) of lane ``i``, with 53 random bits."""
    return (next64(state, i) >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@helper
def bounded(state: States, i: int, count: np.uint64) -> np.int64:
    """A whole number of lane ``i`` from 0, ``count`` < 2^32 of them alike, without bias (Lemire 2019)."""
    unfair = (np.uint64(1 << 32) - count) % count
    product = _next32(state, i) * count
    while (product & _HALF) < unfair:
        product = _next32(state, i) * count
    return np.int64(product >> np.uint64(32))


@kernel
def _uniform(state: States, low: float, span: float, drawn: Array) -> None:
    """``drawn`` (M, N): M numbers of every lane."""
    for k in range(drawn.shape[0]):
        for i in range(drawn.shape[1]):
            drawn[k, i] = low + span * fraction(state, i)


@kernel
def _words64(state: States, drawn: States) -> None:
    for i in range(drawn.shape[0]):
        drawn[i] = next64(state, i)


@kernel
def _bounded(state: States, count: np.uint64, low: int, drawn: NDArray[np.int64]) -> None:
    for i in range(drawn.shape[0]):
        drawn[i] = low + bounded(state, i, count)


class Streams:
    """One random part of an episode for L lanes: what ``stream`` gives for each of them, drawn side by side.

    ``uniform`` and ``integers`` are those of ``numpy.random.Generator``, bit for bit as on a processor without fused
    multiplication; what they return has the lanes, L, as its last axis. ``seeds`` (L,) are of uint64, or Python's whole
    numbers where one is larger; ``episodes`` (L,); ``name`` is one of ``STREAMS``.
    """

    def __init__(self, seeds: NDArray[Any], episodes: NDArray[np.int64], name: str) -> None:
        self._seeds, self._episodes, self._name = seeds, episodes, name

    def generators(self) -> Iterator[np.random.Generator]:
        """NumPy's own generator of each lane, from the beginning of its stream."""
        for seed, episode in zip(self._seeds.tolist(), self._episodes.tolist(), strict=True):
            yield stream(seed, episode, self._name)

    def uniform(self, low: float = 0.0, high: float = 1.0, size: int | tuple[int, ...] = ()) -> Array:
        """Numbers in [low, high), (*size, L)."""
        shape = (size,) if isinstance(size, int) else size
        drawn = np.empty((math.prod(shape), len(self._seeds)))
        _uniform(self._state, float(low), float(high) - float(low), drawn)
        return drawn.reshape(*shape, -1)

    def integers(self, low: int, high: int | None = None, dtype: type = np.int64) -> NDArray[Any]:
        """Whole numbers in [low, high), or in [0, low), (L,); fewer than 2^32 alike, or all 2^64 of uint64.

        Raises ``ValueError`` for others.
        """
        first, beyond = (0, low) if high is None else (low, high)
        count = int(beyond) - int(first)
        drawn: NDArray[Any] = np.full(len(self._seeds), first, dtype=dtype)
        if first == 0 and count == 2**64 and drawn.dtype == np.uint64:
            _words64(self._state, drawn)
        elif not 0 < count < 2**32:
            raise ValueError(f"low = {first}, high = {beyond}; allowed: low < high, less than 2^32 apart, or 2^64 of uint64")
        elif count > 1:
            _bounded(self._state, np.uint64(count), int(first), drawn)
        return drawn

    @cached_property
    def _state(self) -> States:
        state = np.empty((5, len(self._seeds)), dtype=np.uint64)
        if self._seeds.dtype == np.uint64 and self._episodes.max(initial=0) < 2**32:
            words = np.zeros((POOL + 2, len(self._seeds)), dtype=np.uint32)
            words[0], words[1] = self._seeds & _HALF, self._seeds >> np.uint64(32)
            words[POOL], words[POOL + 1] = self._episodes, STREAMS.index(self._name)
            _seed(words, state)
        else:
            for lane, generator in enumerate(self.generators()):
                numbers: Any = generator.bit_generator.state["state"]
                halves = [half for name in ("state", "inc") for half in divmod(numbers[name], 2**64)]
                state[:, lane] = np.array([*halves, 0], dtype=np.uint64)
        return state


TOGETHER = 1024
"""Lanes that begin together; what they draw on the way stays in a processor's cache."""


def worlds(
    lanes: NDArray[np.intp], seeds: Sequence[int], episodes: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.intp], dict[str, Streams]]]:
    """Blocks of ``lanes`` (L,) with the streams of each, by name; seeds and episodes are those of all lanes, (N,)."""
    for first in range(0, len(lanes), TOGETHER):
        block = lanes[first : first + TOGETHER]
        chosen = [seeds[lane] for lane in block.tolist()]
        try:
            numbers: NDArray[Any] = np.array(chosen, dtype=np.uint64)
        except OverflowError:
            numbers = np.array(chosen, dtype=object)
        yield block, {name: Streams(numbers, episodes[block], name) for name in STREAMS}


def begin(part: Any, lanes: NDArray[np.intp], streams: Streams) -> None:
    """Start new episodes of a part: in all lanes (L,) at once if it can, else lane by lane with NumPy's generators."""
    for lane, rng in served(part.begin, lanes, streams):
        part.begin(lane, rng)
