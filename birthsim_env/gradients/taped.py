"""A loop that keeps on a tape what the adjoints of its stages read, and walks it back.

Forward it runs the stages themselves, so that every bit is that of ``loop.Loop``.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.gradients.traced import Adjoint
from birthsim_env.loop.loop import Loop, Place, load_rows, run_stage, store_rows
from birthsim_env.loop.stage import Stage, address_of, carray, pointer
from birthsim_env.loop.stage import call as call_stage
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import load, store

Whole = NDArray[np.int64]

ADJOINT, CONSTANTS, READS, FIRST, COUNT, CLOSES = range(6)
"""Columns of ``_backward``'s entries."""

TABLE, ROW = range(2)
"""Columns of what is read: the address of a table's row, or 0 and a row of the space."""


@helper
def _keep(space: Array, reads: Whole, first: int, count: int, tape: Array, lanes: int, start: int, n: int) -> None:
    for k in range(count):
        table = carray(pointer(reads[first + k, TABLE], np.float64), (lanes,))
        if reads[first + k, TABLE]:
            for i in range(n):
                tape[k, i] = table[start + i]
        else:
            for i in range(n):
                tape[k, i] = space[reads[first + k, ROW], i]


@kernel
def _forward(
    moves: Whole,
    stages: Whole,
    kept: Whole,
    reads: Whole,
    rows: int,
    lanes: int,
    periods: int,
    first: int,
    last: int,
    tape: Array,
) -> int:
    """``moves`` and ``stages`` as in ``loop._run``. ``kept`` (K, 4): a stage, 1 for after it, and where its rows stand
    in ``reads`` (R, 2) and how many they are. ``tape`` (blocks, rows, BLOCK)."""
    space, missed = np.empty((rows, BLOCK)), 0
    base = np.int64(space.ctypes.data)
    for start in range(first, last, BLOCK):
        n, place = min(BLOCK, last - start), 0
        load_rows(moves, lanes, start, n, space)
        for period in range(periods):
            for s in range(stages.shape[0]):
                if stages[s, 6] == 0 or period == periods - 1:
                    for after in range(2):
                        for e in range(kept.shape[0]):
                            if kept[e, 0] == s and kept[e, 1] == after:
                                _keep(space, reads, kept[e, 2], kept[e, 3], tape[start // BLOCK, place:], lanes, start, n)
                                place += kept[e, 3]
                        if after == 0:
                            missed += run_stage(stages, s, base, start, n)
        store_rows(moves, lanes, start, n, space)
    return missed


@kernel
def _backward(
    entries: Whole,
    touched: Whole,
    periods: int,
    first: int,
    last: int,
    rig: Array,
    tape: Array,
    bars: Array,
    takes: int,
    gives: int,
) -> None:
    """``entries`` (E, 6): address of an adjoint, of its constants, rows that it reads from the tape, where its rows stand in
    ``touched`` and how many they are, 1 for a closing one. ``bars`` (rows, N) go back. An adjoint ``takes`` so many
    rows at most, and needs so many for what it ``gives``."""
    space, p = np.empty((bars.shape[0], BLOCK)), np.empty((at.PARAMETERS, BLOCK))
    given, result = np.zeros((takes, BLOCK)), np.zeros((gives, BLOCK))
    for start in range(first, last, BLOCK):
        n, place = min(BLOCK, last - start), tape.shape[1]
        load(bars, start, n, space)
        load(rig, start, n, p)
        for period in range(periods - 1, -1, -1):
            for e in range(entries.shape[0] - 1, -1, -1):
                if entries[e, CLOSES] == 0 or period == periods - 1:
                    where = entries[e, FIRST]
                    place -= entries[e, READS]
                    for k in range(entries[e, COUNT]):
                        for i in range(n):
                            given[k, i] = space[touched[where + k], i]
                    there = tape[start // BLOCK, place:]
                    places = there.ctypes.data, given.ctypes.data, result.ctypes.data, p.ctypes.data
                    call_stage(entries[e, ADJOINT], *places, entries[e, CONSTANTS], start, n)
                    for k in range(entries[e, COUNT]):
                        for i in range(n):
                            space[touched[where + k], i] = result[k, i]
        store(space, start, n, bars)


class TapedLoop(Loop):
    """A ``Loop`` with adjoints, by the index of their stage among ``stages`` and then ``closing``, in the order in which they
    happen. Rows of tables count on from those of the space."""

    def __init__(
        self, lanes: int, world: Sequence[Place], seen: Sequence[Place], stages: Sequence[Stage], closing: Sequence[Stage]
    ) -> None:
        super().__init__(lanes, world, seen, stages, closing)
        self.opened = len(stages)
        self._tape: Array = np.zeros((0, 0, 0))
        self.sources: list[tuple[NDArray[Any] | None, int]] = [(None, row) for row in range(self._rows)]
        """Where each row is: a table and its row, or the space."""
        self._placed: dict[int, int] = {}

    @property
    def memories(self) -> list[int]:
        """Rows of the space at which the memory of each stage begins."""
        return [int(row) for row in self._stages[:, 3]]

    def place(self, table: NDArray[Any], lanes_first: bool = False) -> int:
        """The number of the first row of a stage's table. What is not float64 with lanes last can only be written."""
        if table.shape[0 if lanes_first else -1] != self._lanes:
            raise ValueError(f"a table {table.shape} of {self._lanes} lanes")
        place = table.ctypes.data
        if place not in self._placed:
            self._placed[place] = len(self.sources)
            self.sources += [(table, row) for row in range(table.size // self._lanes)]
        return self._placed[place]

    def differentiate(self, adjoints: Sequence[tuple[int, Adjoint]], live: Sequence[int]) -> None:
        """Go back by these from now on, with bars for ``live`` rows."""
        reads, touched, kept, entries = list[tuple[int, int]](), list[int](), [], []
        self.adjoints, self.live, at = adjoints, live, {row: k for k, row in enumerate(live)}
        for s, one in adjoints:
            kept.append((s, int(one.after), len(reads), len(one.reads)))
            address = 0 if one.constants is None else one.constants.ctypes.data
            where = address_of(one.function)
            entries.append((where, address, len(one.reads), len(touched), len(one.rows), int(s >= self.opened)))
            found = [self.sources[row] for row in one.reads]
            reads += [(0 if table is None else table.ctypes.data + 8 * self._lanes * row, row) for table, row in found]
            touched += [at[row] for row in one.rows]
        self._keeps, self._entries = np.array(kept, dtype=np.int64), np.array(entries, dtype=np.int64)
        self._reads, self._touched = np.array(reads, dtype=np.int64).reshape(-1, 2), np.array(touched, dtype=np.int64)
        self.most = tuple(max(len(one.rows) + room * one.room for _, one in adjoints) for room in (0, 1))

    def new_tape(self, periods: int) -> Array:
        """Room for ``periods`` control periods, the last one with what closes it."""
        closing = self._entries[:, CLOSES] == 1
        size = periods * self._entries[~closing, READS].sum() + self._entries[closing, READS].sum()
        return np.zeros((-(-self._lanes // BLOCK), max(1, size), BLOCK))

    def run_taped(self, periods: int, tape: Array, threads: int = 1) -> int:
        """``run``, which writes ``tape``."""
        self._tape = tape
        return self.run(periods, threads)

    def _between(self, periods: int, first: int, last: int) -> int:
        how = self._moves, self._stages, self._keeps, self._reads, self._rows, self._lanes
        return int(_forward(*how, periods, first, last, self._tape))

    def back(self, periods: int, tape: Array, rig: Array, bars: Array, threads: int = 1) -> None:
        """Take ``bars``, gradients to the live rows at the end (rows, N), to the beginning."""

        def work(periods: int, first: int, last: int) -> int:
            _backward(self._entries, self._touched, periods, first, last, rig, tape, bars, *self.most)
            return 0

        self._spread(work, periods, threads)
