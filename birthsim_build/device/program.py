"""A closed loop over many lanes as data: what the kernels of ``code.threads`` read.

A program is a row of 64-bit words that describes the stages and holds their constants, the tables that all lanes share, and
what a lane begins with. What lanes have of their own, rows of the world, memories and tables, is data: words (rows, lanes).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from birthsim_build.code.tape import ABOUT, CLOSING, LIVE, OPEN
from birthsim_build.code.threads import COUNT, FILL, HEAD, IN_DATA, IN_PROGRAM, MAGIC, MOVE, RELOCATION, STAGE, TIMES, Threads
from birthsim_build.image import Words, function_name
from birthsim_env.gradients.taped import TapedLoop
from birthsim_env.loop.loop import Place
from birthsim_env.loop.rows import SEEN, WORLD
from birthsim_env.loop.stage import TABLE, Stage
from birthsim_env.physics.compiled.lanes import PARAMETERS

HALF = 4
"""Bytes of the numbers in which a lane's beginning is written: all arrays consist of them."""


class Pieces(NamedTuple):
    """The arguments of ``Loop``, and stages that begin an episode, the first of which remembers a ``Start``."""

    world: Sequence[Place]
    seen: Sequence[Place]
    stages: Sequence[Stage]
    closing: Sequence[Stage] = ()
    beginning: Sequence[Stage] = ()

    @property
    def every(self) -> list[Stage]:
        """All stages."""
        return [*self.stages, *self.closing, *self.beginning]

    @property
    def functions(self) -> list[str]:
        """Names of the functions of all stages."""
        return sorted({function_name(stage) for stage in self.every})

    @property
    def lanes(self) -> int:
        """How many there are."""
        return int(self.world[0][0].shape[1])

    def arrays(self) -> list[NDArray[Any]]:
        """All arrays but constants, each once."""
        every = [array for array, _ in (*self.world, *self.seen)]
        for stage in self.every:
            every += [*(() if stage.memory is None else (stage.memory,)), *stage.tables]
        return [*{key_of(array): array for array in reversed(every)}.values()][::-1]


@dataclass(frozen=True)
class Region:
    """Where in the data an array (*before, lanes, *behind) is: its first row, and how many there are."""

    first: int
    rows: int
    before: tuple[int, ...]
    behind: tuple[int, ...]
    dtype: np.dtype[Any]

    def of(self, data: Any, lanes: int) -> Any:
        """The array in ``data`` (rows, lanes), a view; of NumPy, or of what is like it."""
        shape = (*self.before, lanes, *self.behind)
        words = data[self.first : self.first + self.rows].reshape(-1)
        return words.view(self.dtype)[: math.prod(shape)].reshape(shape)

    def at(self, lanes: Any) -> tuple[Any, ...]:
        """What indexes ``lanes`` in the array."""
        return (*(slice(None) for _ in self.before), lanes)


Key = tuple[int, int]
"""Address and size of an array: views of the same memory are one."""


def key_of(array: NDArray[Any]) -> Key:
    """What tells an array from others."""
    return array.__array_interface__["data"][0], array.nbytes


@dataclass(frozen=True)
class Program:
    """``words`` of a program that has not been placed; ``regions`` of arrays, in the order of ``Pieces.arrays``; ``rows`` of
    data that a lane has, and the ``threads`` that run it; and ``about`` the way back, the first words of its description."""

    words: Words
    regions: tuple[Region | None, ...]
    rows: int
    threads: Threads
    about: tuple[int, ...]

    def tape(self, periods: int) -> int:
        """Words of a lane's tape of ``periods`` control periods, the last one with what closes it."""
        return PARAMETERS + self.about[LIVE] + periods * self.about[OPEN] + self.about[CLOSING]


def _regions(many: Pieces, other: Pieces) -> list[Region | None]:
    """Places in the data of all arrays that have an entry per lane, None for others."""
    found: list[Region | None] = []
    rows = 0
    for array, like in zip(many.arrays(), other.arrays(), strict=True):
        sizes = enumerate(zip(array.shape, like.shape, strict=True))
        axes = [axis for axis, pair in sizes if pair == (many.lanes, other.lanes)]
        if not axes or not array.size:
            found.append(None)
            continue
        (axis,) = axes
        size = -(-array.nbytes // many.lanes // 8)
        found.append(Region(rows, size, array.shape[:axis], array.shape[axis + 1 :], array.dtype))
        rows += size
    return found


class _Writer:
    """Writes words behind the lists of a program, from word ``size`` on, and notes what a device has to put into place."""

    def __init__(self, size: int) -> None:
        self.size, self.pieces, self.relocations = size, list[Words](), list[tuple[int, int, int]]()

    def put(self, array: NDArray[Any]) -> int:
        """The word at which the content of an array stands."""
        content = np.ascontiguousarray(array).tobytes()
        self.pieces.append(np.frombuffer(content + bytes(-len(content) % 8), dtype=np.int64))
        self.size += len(self.pieces[-1])
        return self.size - len(self.pieces[-1])

    def refer(self, where: int, kind: int, value: int) -> None:
        """A device puts something into the word ``where``, see ``code.threads.place``."""
        self.relocations.append((where, kind, value))

    def tables(self, stage: Stage, regions: Mapping[Key, Region]) -> int:
        """The word at which the descriptions of a stage's tables stand."""
        about = np.zeros((max(1, len(stage.tables)), TABLE), dtype=np.int64)
        for entry, table in zip(about, stage.tables, strict=False):
            entry[1 : 1 + table.ndim] = table.shape
        first = self.put(about)
        for where, table in enumerate(stage.tables):
            entry_at, region = first + TABLE * where, regions.get(key_of(table))
            if region is None:
                self.refer(entry_at, IN_PROGRAM, self.put(table))
            else:
                self.refer(entry_at, IN_DATA, region.first)
                self.refer(entry_at + table.ndim - len(region.behind), COUNT, 0)
        return first


def _moves(loop: Pieces) -> tuple[list[Place], dict[int, int], int]:
    """Arrays with the rows of a lane's memory to which they are copied, those rows for what stages remember, and all rows."""
    moves = [*loop.world, *((array, WORLD + row) for array, row in loop.seen)]
    rows, memories = WORLD + SEEN, dict[int, int]()
    for stage in loop.every:
        if stage.memory is not None and id(stage.memory) not in memories:
            memories[id(stage.memory)] = rows
            moves.append((stage.memory, rows))
            rows += len(stage.memory)
    return [(array, row) for array, row in moves if array.size], memories, rows


def _way_back(
    taped: TapedLoop, writer: _Writer, regions: Mapping[Key, Region], before: int
) -> tuple[int, tuple[str, ...], int, tuple[int, ...]]:
    """The word at which the way back is described, its functions, the rows that it takes in a thread, and ``Program.about``.

    ``before`` functions stand before its own in the code."""
    names, at = sorted({function_name(one) for _, one in taped.adjoints}), {row: k for k, row in enumerate(taped.live)}
    kept, entries, sizes = [], [], [0, 0]
    for s, one in taped.adjoints:
        found = [taped.sources[row] for row in one.reads]
        reads = [(0, row) if table is None else (1, regions[key_of(table)].first + row) for table, row in found]
        kept.append((s, int(one.after), writer.put(np.array(reads, dtype=np.int64)), len(reads)))
        constants = 0 if one.constants is None else writer.put(one.constants)
        rows = writer.put(np.array([at[row] for row in one.rows], dtype=np.int64))
        closes = int(s >= taped.opened)
        number = before + names.index(function_name(one))
        entries.append((number, constants, len(reads), rows, len(one.rows), closes))
        sizes[closes] += len(reads)
    about = len(taped.live), len(kept), len(entries), *sizes, *taped.most
    space = PARAMETERS + len(taped.live) + sum(taped.most) + max(len(one.reads) for _, one in taped.adjoints)
    return writer.put(np.array([*about, *np.ravel(kept), *np.ravel(entries)], dtype=np.int64)), tuple(names), space, about


def program_of(many: Pieces, other: Pieces, functions: Sequence[str], taped: TapedLoop | None = None) -> Program:
    """The program of a loop; lanes begin as the first of ``many`` does. ``functions`` are those of the code, in order.

    ``other`` is the same loop over another number of lanes, which tells the axis of the lanes in an array. A ``taped`` loop of
    ``many`` says how gradients go back, by adjoints that stand behind the ``functions`` in the code."""
    found = _regions(many, other)
    arrays = [(array, region) for array, region in zip(many.arrays(), found, strict=True) if region]
    regions = {key_of(array): region for array, region in arrays}
    moves, memories, space = _moves(many)
    tables = [table for stage in many.every for table in stage.tables]
    of_lanes = sum(key_of(table) in regions for table in tables)
    counts = (len(moves), len(many.every), len(arrays), len(moves) + 2 * len(many.every) + len(tables) + of_lanes)
    writer = _Writer(HEAD + sum(count * words for count, words in zip(counts, (MOVE, STAGE, FILL, RELOCATION), strict=True)))
    groups = (many.stages, many.closing, many.beginning)
    times = [time for time, group in zip(TIMES, groups, strict=True) for _ in group]
    moved, staged, fills = [], [], []
    for k, (array, row) in enumerate(moves):
        writer.refer(HEAD + MOVE * k, IN_DATA, regions[key_of(array)].first)
        moved.append((0, len(array), row, int(array.flags.writeable)))
    for k, stage in enumerate(many.every):
        memory = space if stage.memory is None else memories[id(stage.memory)]
        staged.append((functions.index(function_name(stage)), times[k], int(stage.sees_world), memory, 0, 0))
        constants = HEAD + MOVE * len(moves) + STAGE * k + 4
        writer.refer(constants, IN_PROGRAM, writer.put(stage.constants))
        writer.refer(constants + 1, IN_PROGRAM, writer.tables(stage, regions))
    for array, region in arrays:
        before, behind = math.prod(region.before), math.prod(region.behind) * region.dtype.itemsize // HALF
        fills.append((region.first, before, behind, writer.put(array[region.at(0)])))
    nothing = 0, (), 0, (0,) * ABOUT
    way_back, adjoints, back, about = _way_back(taped, writer, regions, len(functions)) if taped else nothing
    rows = sum(region.rows for region in regions.values())
    head = np.array([MAGIC, writer.size, 0, 0, rows, space, 0, *counts, way_back], dtype=np.int64)
    lists = [np.ravel(np.array(one, dtype=np.int64)) for one in (moved, staged, fills, writer.relocations)]
    threads = Threads(space, adjoints, back)
    return Program(np.concatenate([head, *lists, *writer.pieces]), tuple(found), rows, threads, about)
