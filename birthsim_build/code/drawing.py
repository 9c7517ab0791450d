"""What the code of ``device.drawing`` draws with: the streams of ``parts.drawn.streams``, over a block."""

import numpy as np

from birthsim_env.loop.stage import carray, pointer, scratch
from birthsim_env.loop.world import Start
from birthsim_env.parts.drawn.streams import POOL, States, Words, bounded, fraction, next64, seed
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

WORDS, OUT = POOL + 2, 2 * POOL
"""32-bit words of an episode's entropy, and of what a stream begins with."""


@helper
def _words(room: Array, rows: int) -> Words:
    """Room for numbers as room for words of 32 bits, (rows, BLOCK)."""
    return carray(pointer(int(room.ctypes.data), np.uint32), (rows, BLOCK))


@helper
def seeded(own: Start, stream: int, state: States, n: int) -> None:
    """Begin the stream of this number in ``STREAMS``."""
    numbers, words = own.rows.view(np.uint64), _words(scratch(WORDS), WORDS)
    pool, out = _words(scratch(POOL), POOL), _words(scratch(OUT), OUT)
    for i in range(n):
        words[0, i], words[1, i] = numbers[0, i] & np.uint64(0xFFFFFFFF), numbers[0, i] >> np.uint64(32)
        words[2, i], words[3, i] = np.uint32(0), np.uint32(0)
        words[4, i], words[5, i] = numbers[1, i], np.uint32(stream)
    seed(words, pool, out, state, n)


@helper
def fractions(state: States, drawn: Array, first: int, beyond: int, n: int) -> None:
    """Numbers in [0, 1) into the rows of ``drawn`` from ``first`` on."""
    for k in range(first, beyond):
        for i in range(n):
            drawn[k, i] = fraction(state, i)


@helper
def whole(state: States, drawn: Array, row: int, low: int, count: int, n: int) -> None:
    """A whole number from ``low`` on, ``count`` of them alike."""
    for i in range(n):
        drawn[row, i] = low + bounded(state, i, np.uint64(count))


@helper
def bits(state: States, drawn: Array, row: int, n: int) -> None:
    """64 bits, in the place of a number."""
    for i in range(n):
        drawn.view(np.uint64)[row, i] = next64(state, i)
