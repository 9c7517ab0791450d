"""New episodes of many lanes: their random streams, handed to every part that draws from them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.drawn.seeding import STREAMS, served
from birthsim_env.parts.drawn.streams import Streams

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
