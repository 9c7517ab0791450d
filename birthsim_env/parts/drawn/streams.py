"""The random streams of many lanes at once: what NumPy's generators give lane by lane, to the last bit."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.drawn.philox import fraction, word
from birthsim_env.parts.drawn.seeding import STREAMS, served, stream, stream_key
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array

Words = NDArray[np.uint64]

SEED, PART = range(2)
"""Rows of keys (2, N), as ``stream_key`` has them."""


@kernel
def _uniform(keys: Words, number: int, low: float, span: float, drawn: Array) -> None:
    """``drawn`` (M, N): M numbers of every lane, of its words from ``number`` on."""
    for k in range(drawn.shape[0]):
        for i in range(drawn.shape[1]):
            drawn[k, i] = low + span * fraction(word(keys[SEED, i], keys[PART, i], np.uint64(number + k)))


@kernel
def _bits(keys: Words, number: int, drawn: Words) -> None:
    for i in range(drawn.shape[0]):
        drawn[i] = word(keys[SEED, i], keys[PART, i], np.uint64(number))


class Streams:
    """One random part of an episode for L lanes: what ``stream`` gives for each of them, drawn side by side.

    ``uniform`` and ``integers`` are those of ``numpy.random.Generator``, bit for bit as on a processor without fused
    multiplication; what they return has the lanes, L, as its last axis. ``seeds`` and ``episodes`` are those of the lanes,
    (L,); ``name`` is one of ``STREAMS``.
    """

    def __init__(self, seeds: Sequence[int], episodes: NDArray[np.int64], name: str) -> None:
        self._who = seeds, episodes.tolist(), name
        self._keys = np.array([stream_key(*each, name) for each in zip(*self._who[:2], strict=True)], dtype=np.uint64).T.copy()
        self._number = 0

    def generators(self) -> Iterator[np.random.Generator]:
        """NumPy's own generator of each lane, from the beginning of its stream."""
        seeds, episodes, name = self._who
        for seed, episode in zip(seeds, episodes, strict=True):
            yield stream(seed, episode, name)

    def uniform(self, low: float = 0.0, high: float = 1.0, size: int | tuple[int, ...] = ()) -> Array:
        """Numbers in [low, high), (*size, L)."""
        shape = (size,) if isinstance(size, int) else size
        drawn = np.empty((math.prod(shape), self._keys.shape[1]))
        _uniform(self._keys, self._number, float(low), float(high) - float(low), drawn)
        self._number += len(drawn)
        return drawn.reshape(*shape, -1)

    def integers(self, high: int, dtype: type) -> Words:
        """All whole numbers of ``np.uint64`` alike, (L,); ``seeding.whole`` draws fewer. Raises ``ValueError`` for others."""
        if high != 2**64 or dtype is not np.uint64:
            raise ValueError(f"high = {high}, dtype = {dtype}; allowed: 2^64 of numpy.uint64, else seeding.whole(rng, ...)")
        drawn = np.empty(self._keys.shape[1], dtype=np.uint64)
        _bits(self._keys, self._number, drawn)
        self._number += 1
        return drawn


TOGETHER = 1024
"""Lanes that begin together; what they draw on the way stays in a processor's cache."""


def worlds(
    lanes: NDArray[np.intp], seeds: Sequence[int], episodes: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.intp], dict[str, Streams]]]:
    """Blocks of ``lanes`` (L,) with the streams of each, by name; seeds and episodes are those of all lanes, (N,)."""
    for first in range(0, len(lanes), TOGETHER):
        block = lanes[first : first + TOGETHER]
        chosen = [seeds[lane] for lane in block.tolist()]
        yield block, {name: Streams(chosen, episodes[block], name) for name in STREAMS}


def begin(part: Any, lanes: NDArray[np.intp], streams: Streams) -> None:
    """Start new episodes of a part: in all lanes (L,) at once if it can, else lane by lane with NumPy's generators."""
    for lane, rng in served(part.begin, lanes, streams):
        part.begin(lane, rng)
