"""What runs a program (``device.program``) on a device: one thread a lane, a lane's rows in the thread's own memory, but for
what the plant is integrated from (``blocks``).

A graphics processor lays out the memory of neighbouring threads word by word side by side, and so do programs with the data of
their lanes: what 32 threads read or write at once lies together.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from birthsim_build.code.advance import words, wrapper
from birthsim_build.code.blocks import WIDTH, block_code
from birthsim_build.code.tape import begin_tape, keep
from birthsim_env.loop.loop import load_rows, store_rows
from birthsim_env.loop.rows import WORLD
from birthsim_env.loop.stage import call, carray, pointer
from birthsim_env.loop.world import Start
from birthsim_env.physics.compiled.compilation import helper, kernel

MAGIC = 0x31_73_64_61_65_72_68_74
"""First word of a program: the version of this format, "threads1"."""

HEAD = 12
FORMAT, WORDS, LANES, DATA, ROWS, SPACE, MISSED, MOVES, STAGES, FILLS, RELOCATIONS, WAY_BACK = range(HEAD)
"""Words of a program's head: ``MAGIC``; its words in all; lanes, and the address of their data; words of data of a lane, and
rows of its memory in a period; how often a stage could not serve a lane; and how many of each of these follow, in this
order; and the word at which the way back is described (``tape``), 0 where there is none."""

MOVE, STAGE, FILL, RELOCATION = 4, 6, 4, 3
"""Words of each. A move: address of an array (rows, lanes), its rows, the first row of a lane's memory, whether it is written.
A stage: number of its function, when it runs, 1 if it sees the world, the first row of what it remembers;
addresses of its constants and of what describes its tables. A fill: first row of an array in the data, its numbers of 32 bits
before and behind its lanes, and the word at which those of a lane that begins are. A relocation: see ``place``."""

TIMES = PERIOD, CLOSES, BEGINS = range(3)
"""When a stage runs: in every control period, at the end of a policy step, where an episode begins."""

IN_PROGRAM, IN_DATA, COUNT = range(3)
"""Kinds of relocation: the address of a word of the program, that of a row of the data, the number of lanes."""


@kernel
def place(program: int, lane: int, data: int, lanes: int) -> int:
    """Put what depends on where program and ``data`` are, and on the number of ``lanes``, into a program; lane 0 does it.

    A relocation is the word to be written, its kind, and a number of words or rows."""
    if lane > 0:
        return 0
    head = words(program, HEAD)
    head[LANES], head[DATA], head[MISSED] = lanes, data, 0
    first = HEAD + MOVE * head[MOVES] + STAGE * head[STAGES] + FILL * head[FILLS]
    for k in range(head[RELOCATIONS]):
        where, kind, value = words(program + 8 * (first + RELOCATION * k), RELOCATION)
        to = program + 8 * value if kind == IN_PROGRAM else data + 8 * lanes * value
        words(program + 8 * where, 1)[0] = lanes if kind == COUNT else to
    return 0


@helper
def _fill(program: int, lane: int) -> None:
    """What an episode does not draw is as the program says."""
    head = words(program, HEAD)
    lanes, first = head[LANES], HEAD + MOVE * head[MOVES] + STAGE * head[STAGES]
    for k in range(head[FILLS]):
        row, before, behind, at = words(program + 8 * (first + FILL * k), FILL)
        begun = carray(pointer(program + 8 * at, np.int32), (before, behind))
        array = carray(pointer(head[DATA] + 8 * lanes * row, np.int32), (before, lanes, behind))
        for j in range(before):
            for i in range(behind):
                array[j, lane, i] = begun[j, i]


@kernel
def begin(program: int, k: int, chosen: int, count: int, space: int, dispatch: int) -> int:
    """An episode begins in one of ``count`` lanes, with its memory at the address ``space``.

    At the address ``chosen`` are words (1 + ``Start.size``, count): numbers of the lanes, and a ``Start`` of each, which the
    stages that begin episodes share as their memory. ``dispatch`` is as for ``advance``."""
    if k >= count:
        return 0
    head, lane, missed = words(program, HEAD), words(chosen + 8 * k, 1)[0], 0
    _fill(program, lane)
    moves = carray(pointer(program + 8 * HEAD, np.int64), (head[MOVES], MOVE))
    rows, first = carray(pointer(space, np.float64), (head[SPACE], 1)), program + 8 * (HEAD + MOVE * head[MOVES])
    load_rows(moves, head[LANES], lane, 1, rows)
    begun = False
    for s in range(head[STAGES]):
        number, when, sees, memory, constants, tables = words(first + 8 * STAGE * s, STAGE)
        if when == BEGINS:
            own = space + 8 * memory
            for j in range(0 if begun else Start.size):
                words(own + 8 * j, 1)[0] = words(chosen + 8 * (count * (1 + j) + k), 1)[0]
            begun = True
            missed += call(dispatch, number, space if sees else 0, space + 8 * WORLD, own, constants, tables, lane)
    store_rows(moves, head[LANES], lane, 1, rows)
    return missed


@kernel
def advance(program: int, lane: int, periods: int, tape: int, space: int, dispatch: int) -> int:
    """Run control periods of a lane, with its memory at the address ``space``; how often a stage could not serve it.

    Where the address ``tape`` is not 0, what adjoints read is kept there.

    ``dispatch`` is the address of what calls a stage by its number.
    """
    head, missed = words(program, HEAD), 0
    lanes, stages = head[LANES], head[STAGES]
    if lane >= lanes:
        return 0
    moves = carray(pointer(program + 8 * HEAD, np.int64), (head[MOVES], MOVE))
    rows, first = carray(pointer(space, np.float64), (head[SPACE], 1)), program + 8 * (HEAD + MOVE * head[MOVES])
    load_rows(moves, lanes, lane, 1, rows)
    about, kept = program + 8 * head[WAY_BACK], 0
    if tape:
        kept = begin_tape(about, tape, lanes, lane, rows)
    for period in range(periods):
        for s in range(stages):
            number, when, sees, memory, constants, tables = words(first + 8 * STAGE * s, STAGE)
            if when == PERIOD or (when == CLOSES and period == periods - 1):
                own, world = space + 8 * memory, space if sees else 0
                if tape:
                    kept = keep(program, about, head[DATA], tape, lanes, lane, rows, s, 0, kept)
                missed += call(dispatch, number, world, space + 8 * WORLD, own, constants, tables, lane)
                if tape:
                    kept = keep(program, about, head[DATA], tape, lanes, lane, rows, s, 1, kept)
    store_rows(moves, lanes, lane, 1, rows)
    return missed


PLACE, BEGIN, ADVANCE = RUNS = ("place", "begin", "advance")
"""What a device is asked to run, each with the address of a program and two whole numbers."""

BACK = "backward"
"""What it is asked to run besides where there are adjoints (``code.adjoints.backward``)."""


class Threads(NamedTuple):
    """What code needs besides stages where threads run lanes: rows of a lane's memory; for the way back, functions of adjoints
    (``module:name``) and the rows that they need."""

    space: int
    adjoints: Sequence[str] = ()
    back_space: int = 0

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of what a device is asked to run."""
        return (*RUNS, *((BACK,) if self.adjoints else ()))


def threads_code(threads: Threads, symbols: Sequence[str], kernels: Sequence[str], device: bool) -> str:
    """LLVM code of ``birthsim_place`` and all other ``Threads.runs``.

    ``symbols`` are those of the stages and then of the adjoints, ``kernels`` those of what is run. On a ``device`` these are
    kernels, which know their thread; elsewhere functions that are told it: thread, block, threads a block.
    """
    wrappers = "\n".join(wrapper(k, symbol, "i64 %lane") for k, symbol in enumerate(symbols))
    stages, own = len(symbols) - len(threads.adjoints), (ADVANCE, threads.space)
    rooms = {BEGIN: own, ADVANCE: own, BACK: (BACK, threads.back_space)}
    pairs = zip(threads.runs, kernels, strict=True)
    entries = "".join(_entry(name, symbol, *rooms.get(name, ("", 0))) for name, symbol in pairs)
    return f"""
{wrappers}
{_dispatch(ADVANCE, range(stages))}
{_dispatch(BACK, range(stages, len(symbols)))}
{entries}
{block_code(device)}
{_kernels(threads.runs) if device else _functions(threads.runs)}"""


def _dispatch(name: str, numbers: Iterable[int]) -> str:
    """What calls a stage, or an adjoint, by its number."""
    cases = " ".join(f"i64 {k}, label %case{k}" for k in numbers)
    given = ", ".join(f"i64 %{k}" for k in range(1, 6))
    calls = "\n".join(f"case{k}:\n  %m{k} = call i64 @birthsim_stage_{k}({given}, i64 %lane)\n  ret i64 %m{k}" for k in numbers)
    return f"""
define internal i64 @{name}_one(i64 %0, {given}, i64 %lane) nounwind {{
  switch i64 %0, label %none [ {cases} ]
{calls}
none:
  ret i64 1
}}"""


def _entry(name: str, symbol: str, calls: str, space: int) -> str:
    """What a thread does, which ``calls`` stages or adjoints: the same code on a device and elsewhere."""
    more, types, room = "", "", ""
    if space:
        more, types = f", i64 %space, i64 ptrtoint (ptr @{calls}_one to i64)", ", i64, i64"
        room = f"  %rows = alloca [{space} x double], align 8\n  %space = ptrtoint ptr %rows to i64\n"
    return f"""
declare i32 @"{symbol}"(ptr, ptr, i64, i64, i64, i64{types})
define internal void @{name}(i64 %thread, i64 %block, i64 %width, ptr %program, i64 %one, i64 %two) nounwind {{
  %missed = alloca i64
  %error = alloca ptr
{room}  %first = mul i64 %block, %width
  %lane = add i64 %first, %thread
  %at = ptrtoint ptr %program to i64
  store i64 0, ptr %missed
  %status = call i32 @"{symbol}"(ptr %missed, ptr %error, i64 %at, i64 %lane, i64 %one, i64 %two{more})
  %value = load i64, ptr %missed
  %some = icmp ne i64 %value, 0
  br i1 %some, label %add, label %end
add:
  %counter = getelementptr i64, ptr %program, i64 {MISSED}
  %before = atomicrmw add ptr %counter, i64 %value monotonic
  br label %end
end:
  ret void
}}"""


def _functions(names: Iterable[str]) -> str:
    return "".join(
        f"""
define void @birthsim_{name}(i64 %thread, i64 %block, i64 %width, ptr %program, i64 %one, i64 %two) nounwind {{
  call void @{name}(i64 %thread, i64 %block, i64 %width, ptr %program, i64 %one, i64 %two)
  ret void
}}"""
        for name in names
    )


def _limited(name: str) -> str:
    """To blocks of ``WIDTH`` where they share memory. Others are not: where ptxas is told, it spills more of an adjoint."""
    return f' "nvvm.maxntid"="{WIDTH}"' if name == ADVANCE else ""


def _kernels(names: Iterable[str]) -> str:
    places = {"thread": "tid", "block": "ctaid", "width": "ntid"}
    declared = "".join(f"\ndeclare i32 @llvm.nvvm.read.ptx.sreg.{place}.x()" for place in places.values())
    known = "".join(
        f"  %{one} = call i32 @llvm.nvvm.read.ptx.sreg.{place}.x()\n  %{one}64 = zext i32 %{one} to i64\n"
        for one, place in places.items()
    )
    return declared + "".join(
        f"""
define ptx_kernel void @birthsim_{name}(ptr %program, i64 %one, i64 %two) nounwind{_limited(name)} {{
{known}  call void @{name}(i64 %thread64, i64 %block64, i64 %width64, ptr %program, i64 %one, i64 %two)
  ret void
}}"""
        for name in names
    )
