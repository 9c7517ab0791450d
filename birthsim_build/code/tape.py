"""A tape: what the way forward keeps of a lane for the way back, and the words of a program that say so (``code.adjoints``)."""

import numpy as np

from birthsim_build.code.advance import words
from birthsim_env.loop.stage import carray, numbers, pointer
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array

ABOUT = 7
LIVE, KEEPS, ENTRIES, OPEN, CLOSING, TAKES, GIVES = range(ABOUT)
"""Words of a description: live rows; how many of each of these follow; words that a period, and what closes a policy step,
keep on the tape; rows that an adjoint takes, and that it needs for what it gives, at most."""

KEEP, READ, ENTRY = 4, 2, 6
"""Words of each. What is kept: a stage, 1 for after it, the word at which its rows begin, and how many they are. Such a row:
1 for one of the data, and its number there or in a lane's memory. An entry: number of an adjoint, words at which its constants
begin, words that it reads from the tape, the word at which the rows begin whose bars it takes and gives, how many they are,
and 1 for a closing one."""


@helper
def column(tape: int, lanes: int, rows: int) -> Array:
    """The tape (rows, lanes) at an address."""
    return carray(pointer(tape, np.float64), (rows, lanes))


@helper
def begin_tape(about: int, tape: int, lanes: int, lane: int, rows: Array) -> int:
    """Write the rig of a lane to the tape; the row at which begins what stages keep.

    ``about`` is the address of the description, ``rows`` the lane's memory."""
    for row in range(PARAMETERS):
        column(tape, lanes, PARAMETERS)[row, lane] = rows[row, 0]
    return PARAMETERS + int(words(about, ABOUT)[LIVE])


@helper
def keep(
    program: int, about: int, data: int, tape: int, lanes: int, lane: int, rows: Array, stage: int, after: int, place: int
) -> int:
    """Write what adjoints read of a lane around a stage to the tape, from row ``place`` on; the row behind it."""
    for e in range(words(about, ABOUT)[KEEPS]):
        own, late, first, count = words(about + 8 * (ABOUT + KEEP * e), KEEP)
        if own == stage and late == after:
            for k in range(count):
                of_data, row = words(program + 8 * (first + READ * k), READ)
                to = numbers(tape + 8 * (lanes * place + lane), 1)
                if of_data:
                    to[0] = numbers(data + 8 * (lanes * row + lane), 1)[0]
                else:
                    to[0] = rows[row, 0]
                place += 1
    return place
