"""What the code of ``device.drawing`` draws with: the streams of ``parts.drawn.streams``, over a block."""

import numpy as np

from birthsim_env.loop.world import Start
from birthsim_env.parts.drawn.philox import fraction, word
from birthsim_env.parts.drawn.seeding import STREAMS
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

KINDS = np.uint64(len(STREAMS))


@helper
def _word(own: Start, stream: int, number: int, i: int) -> np.uint64:
    """A word of the stream of this number in ``STREAMS``, whose key is that of ``seeding.stream_key``."""
    words = Start(own.rows.view(np.uint64))
    return word(words.seed[i], KINDS * words.episode[i] + np.uint64(stream), np.uint64(number))


@helper
def uniform(own: Start, stream: int, number: int, drawn: Array, first: int, count: int, n: int) -> None:
    """Numbers in [0, 1), of the words from this ``number`` on, into ``count`` rows of ``drawn`` from ``first`` on."""
    for k in range(count):
        for i in range(n):
            drawn[first + k, i] = fraction(_word(own, stream, number + k, i))


@helper
def bits(own: Start, stream: int, number: int, drawn: Array, row: int, n: int) -> None:
    """A word, in the place of a number."""
    for i in range(n):
        drawn.view(np.uint64)[row, i] = _word(own, stream, number, i)
