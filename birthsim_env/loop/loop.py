"""Runs stages over blocks of lanes: one call for all periods of a policy step, blocks spread over threads.

A block of lanes is copied into scratch rows, goes through all periods there, and is copied back. Lanes never meet, so neither
the number of lanes nor that of threads changes a bit.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache, partial
from itertools import chain, groupby

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import SEEN, TIME, WORLD
from birthsim_env.loop.stage import Part, Stage, address_of, carray, described, pointer
from birthsim_env.loop.stage import call as call_stage
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel, of_numbers
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.plain import DEBUG
from birthsim_env.physics.dynamics import load, store

WORTH_A_THREAD = 300
"""Lanes times periods that are worth another thread, which takes about 0.1 ms to set to work; a lane and period takes 0.4 to
0.9 us."""

MOVE, ENTRY = 4, 7
"""Whole numbers that describe an array that is moved, and a stage."""

Place = tuple[Array, int]
"""An array (rows, N) and the row of ``World``, or of ``Seen``, at which it stands in a block."""


@helper
def load_rows(moves: NDArray[np.int64], lanes: int, start: int, n: int, space: Array) -> None:
    """Copies ``n`` lanes from ``start`` on, of arrays that ``_run`` describes, into a block (rows, BLOCK)."""
    for m in range(moves.shape[0]):
        count, row = moves[m, 1], moves[m, 2]
        load(carray(pointer(moves[m, 0], np.float64), (count, lanes)), start, n, space[row:])


@helper
def store_rows(moves: NDArray[np.int64], lanes: int, start: int, n: int, space: Array) -> None:
    """Copies the block back into those arrays that are written."""
    for m in range(moves.shape[0]):
        count, row = moves[m, 1], moves[m, 2]
        if moves[m, 3]:
            store(space[row:], start, n, carray(pointer(moves[m, 0], np.float64), (count, lanes)))


@helper
def run_stage(stages: NDArray[np.int64], s: int, base: np.int64, start: int, n: int) -> int:
    """Calls one of the ``stages`` that ``_run`` describes, on a block at the address ``base``; what it returns."""
    places = (
        base + stages[s, 1] * BLOCK * 8 if stages[s, 1] >= 0 else 0,
        base + stages[s, 2] * BLOCK * 8,
        base + stages[s, 3] * BLOCK * 8,
    )
    return call_stage(stages[s, 0], *places, stages[s, 4], stages[s, 5], start, n)


MOVES, MOVED, STAGES, STAGED, ROWS, LANES = range(6)
"""Where the whole numbers that describe a loop stand."""


@kernel
def _run(about: int, periods: int, first: int, last: int) -> int:
    """At ``about``: address and number of moves, address and number of stages, rows of the space, lanes.

    Moves (M, 4): address of an array, its rows, its first row in a block, whether it is written. Stages (S, 7): address of
    the function; rows at which world, seen and memory begin (-1: none); addresses of constants and tables; 1 for a closing
    stage."""
    told = carray(pointer(about, np.int64), (LANES + 1,))
    moves = carray(pointer(told[MOVES], np.int64), (told[MOVED], MOVE))
    stages = carray(pointer(told[STAGES], np.int64), (told[STAGED], ENTRY))
    rows, lanes = told[ROWS], told[LANES]
    space, missed = np.empty((rows, BLOCK)), 0
    base = np.int64(space.ctypes.data)
    for start in range(first, last, BLOCK):
        n = min(BLOCK, last - start)
        load_rows(moves, lanes, start, n, space)
        for period in range(periods):
            for s in range(stages.shape[0]):
                if stages[s, 6] == 0 or period == periods - 1:
                    missed += run_stage(stages, s, base, start, n)
        store_rows(moves, lanes, start, n, space)
    return missed


@cache
def _pool(process: int, threads: int) -> ThreadPoolExecutor:
    """Threads of this process: those of a parent do not survive a fork."""
    return ThreadPoolExecutor(threads, "birthsim")


def available_threads() -> int:
    """The processors that this process may use, at most ``OMP_NUM_THREADS`` where that is set."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    limit = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(usable, int(limit)) if limit.isdigit() else usable)


class Loop:
    """Stages in the order in which a control period runs them, over ``lanes`` lanes.

    ``world`` and ``seen`` place arrays of the caller, C-contiguous float64, which are read before and, where they are
    writeable, written after a run;
    ``closing`` stages run once, after the last period. Stages may share one memory. The arrays must outlive the loop.
    """

    def __init__(
        self, lanes: int, world: Sequence[Place], seen: Sequence[Place], stages: Sequence[Stage], closing: Sequence[Stage] = ()
    ) -> None:
        self._lanes, self._kept = lanes, (world, seen, stages, closing)
        placed = [*world, *((array, WORLD + row) for array, row in seen)]
        self._rows, moves, entries = WORLD + SEEN, [], []
        for array, row in placed:
            moves.append(self._move(array, row))
        self._tables: list[NDArray[np.int64]] = []
        memories: dict[int, int] = {}
        for stage, closes in [*((one, 0) for one in stages), *((one, 1) for one in closing)]:
            memory = self._rows if stage.memory is None else memories.setdefault(id(stage.memory), self._rows)
            if stage.memory is not None and memory == self._rows:
                moves.append(self._move(stage.memory, memory))
                self._rows += stage.memory.shape[0]
            about = described(stage.tables)
            self._tables.append(about)
            places = (0 if stage.sees_world else -1, WORLD, memory)
            entries.append((address_of(stage.function), *places, stage.constants.ctypes.data, about.ctypes.data, closes))
        self._moves = np.array(moves, dtype=np.int64).reshape(-1, MOVE)
        self._stages = np.array(entries, dtype=np.int64).reshape(-1, ENTRY)
        described_by = ((table.ctypes.data, len(table)) for table in (self._moves, self._stages))
        self._about = np.array([*chain.from_iterable(described_by), self._rows, lanes], dtype=np.int64)
        self._work: Callable[[int, int, int], int] = partial(of_numbers(_run), self._about.ctypes.data)

    def _move(self, array: Array, row: int) -> tuple[int, int, int, int]:
        if array.dtype != np.float64 or not array.flags.c_contiguous or array.ndim != 2 or array.shape[1] != self._lanes:
            raise ValueError(
                f"an array {array.dtype} {array.shape} in a loop; allowed: float64, contiguous, (rows, {self._lanes})"
            )
        return array.ctypes.data, array.shape[0], row, int(array.flags.writeable)

    def run(self, periods: int = 1, threads: int = 1) -> int:
        """Run ``periods`` control periods; returns how many lanes and periods a stage could not serve."""
        return self._spread(self._between, periods, threads)

    def _spread(self, work: Callable[[int, int, int], int], periods: int, threads: int) -> int:
        """The sum of ``work(periods, first, last)`` over lanes from ``first`` to ``last``, spread over threads."""
        blocks = -(-self._lanes // BLOCK)
        parts = 1 if DEBUG else max(1, min(threads, blocks, self._lanes * periods // WORTH_A_THREAD))
        if parts == 1:
            return work(periods, 0, self._lanes)
        edges = [BLOCK * (blocks * k // parts) for k in range(parts)] + [self._lanes]
        # What runs in a thread holds this loop, and with it the arrays that it knows by address.
        waiting = [_pool(os.getpid(), parts - 1).submit(work, periods, edges[k], edges[k + 1]) for k in range(1, parts)]
        try:
            missed = work(periods, edges[0], edges[1])
        finally:
            wait(waiting)
        return missed + sum(one.result() for one in waiting)

    def _between(self, periods: int, first: int, last: int) -> int:
        return self._work(periods, first, last)


def sampled(stage: Stage, time: Array, first: int, count: int) -> Array:
    """The rows (``count``, N) of ``Seen`` from ``first`` on that a stage writes at ``time`` (N,), s, of N lanes."""
    now, rows = np.array(time[None], dtype=np.float64), np.zeros((count, len(time)))
    Loop(len(time), [], [(now, TIME), (rows, first)], [stage]).run()
    return rows


_Piece = Loop | Callable[[int], None]


class MixedLoop:
    """Stages, and a user's own Python among them, for which the loop stops: it is called with the number of the period.

    Arguments as for ``Loop``. Where all is compiled, all periods are one call.
    """

    def __init__(
        self,
        lanes: int,
        world: Sequence[Place],
        seen: Sequence[Place],
        parts: Sequence[Part],
        closing: Sequence[Part] = (),
    ) -> None:
        def pieces(parts: Sequence[Part]) -> list[_Piece]:
            found: list[_Piece] = []
            for _, group in groupby(parts, lambda part: isinstance(part, Stage)):
                alike = list(group)
                stages = [part for part in alike if isinstance(part, Stage)]
                found += (
                    [Loop(lanes, world, seen, stages)] if stages else [part for part in alike if not isinstance(part, Stage)]
                )
            return found

        stages = [[part for part in group if isinstance(part, Stage)] for group in (parts, closing)]
        self.stops = len(stages[0]) < len(parts)
        """Whether a user's own Python is among the parts."""
        compiled = not self.stops and len(stages[1]) == len(closing)
        self._whole = Loop(lanes, world, seen, *stages) if compiled else None
        self._pieces = [self._whole] if self._whole else pieces(parts)
        self._closing = [] if self._whole else pieces(closing)

    def run(self, periods: int = 1, threads: int = 1) -> int:
        """Run ``periods`` control periods; returns how many lanes and periods a stage could not serve."""
        if self._whole is not None:
            return self._whole.run(periods, threads)
        missed = 0
        for period in range(periods):
            missed += _run_pieces(self._pieces, period, threads)
        return missed + _run_pieces(self._closing, periods - 1, threads)


def _run_pieces(pieces: Sequence[_Piece], period: int, threads: int) -> int:
    missed = 0
    for piece in pieces:
        if isinstance(piece, Loop):
            missed += piece.run(1, threads)
        else:
            piece(period)
    return missed
