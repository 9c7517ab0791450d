"""What runs an image, as LLVM code: ``birthsim_advance``, which calls stages by their numbers."""

from __future__ import annotations

from collections.abc import Sequence

from birthsim_build.image import ENTRY, HEAD, PART_HEAD
from birthsim_build.layout import INPUTS, ROWS
from birthsim_env.loop.rows import WORLD
from birthsim_env.loop.stage import ARGUMENTS

STAGE_ARGUMENTS = 5
"""Addresses of world, seen, memory, constants and tables: the lane is 0 and one alone."""


def advance_code(stages: Sequence[str]) -> str:
    """LLVM code of ``int32_t birthsim_advance(int64_t *image, int32_t periods)``; ``stages`` are symbols of compiled kernels.

    It runs ``periods`` control periods and returns how many stages could not serve. Before, it puts the addresses of tables
    into their descriptions, so that an image may have been copied.
    """
    wrappers = "\n".join(_wrapper(number, symbol) for number, symbol in enumerate(stages))
    pointers = ", ".join(f"ptr @birthsim_stage_{number}" for number in range(len(stages)))
    return f"""
{wrappers}
@birthsim_stages = internal constant [{len(stages)} x ptr] [{pointers}]

define i32 @birthsim_advance(ptr noundef %image, i32 noundef %periods) nounwind {{
start:
  %rows = getelementptr i64, ptr %image, i64 {HEAD}
  %world = ptrtoint ptr %rows to i64
  %seen.at = getelementptr i64, ptr %rows, i64 {WORLD}
  %seen = ptrtoint ptr %seen.at to i64
  %inputs.at = getelementptr i64, ptr %rows, i64 {ROWS - INPUTS}
  %inputs = ptrtoint ptr %inputs.at to i64
  %count.at = getelementptr i64, ptr %image, i64 2
  %count = load i64, ptr %count.at
  %first = getelementptr i64, ptr %rows, i64 {ROWS}
  br label %place.part
place.part:
  %p = phi i64 [ 0, %start ], [ %p.next, %placed ]
  %put = phi ptr [ %first, %start ], [ %put.next, %placed ]
  %any = icmp slt i64 %p, %count
  br i1 %any, label %place, label %periods.begin
place:
  %put.words = load i64, ptr %put
  %put.next = getelementptr i64, ptr %put, i64 %put.words
  %put.stages.at = getelementptr i64, ptr %put, i64 1
  %put.stages = load i64, ptr %put.stages.at
  %put.tables.at = getelementptr i64, ptr %put, i64 2
  %put.tables = load i64, ptr %put.tables.at
  %entries.words = mul i64 %put.stages, {ENTRY}
  %addresses.from = add i64 %entries.words, {PART_HEAD}
  %addresses = getelementptr i64, ptr %put, i64 %addresses.from
  br label %place.address
place.address:
  %a = phi i64 [ 0, %place ], [ %a.next, %place.one ]
  %a.any = icmp slt i64 %a, %put.tables
  br i1 %a.any, label %place.one, label %placed
place.one:
  %a.twice = mul i64 %a, 2
  %slot.at = getelementptr i64, ptr %addresses, i64 %a.twice
  %slot = load i64, ptr %slot.at
  %target.at = getelementptr i64, ptr %slot.at, i64 1
  %target = load i64, ptr %target.at
  %table.at = getelementptr i64, ptr %put, i64 %target
  %table = ptrtoint ptr %table.at to i64
  %slot.put = getelementptr i64, ptr %put, i64 %slot
  store i64 %table, ptr %slot.put
  %a.next = add i64 %a, 1
  br label %place.address
placed:
  %p.next = add i64 %p, 1
  br label %place.part
periods.begin:
  br label %period
period:
  %t = phi i32 [ 0, %periods.begin ], [ %t.next, %period.end ]
  %missed.t = phi i64 [ 0, %periods.begin ], [ %missed.p, %period.end ]
  %t.any = icmp slt i32 %t, %periods
  br i1 %t.any, label %part, label %end
part:
  %q = phi i64 [ 0, %period ], [ %q.next, %part.end ]
  %at = phi ptr [ %first, %period ], [ %at.next, %part.end ]
  %missed.p = phi i64 [ %missed.t, %period ], [ %missed.s, %part.end ]
  %q.any = icmp slt i64 %q, %count
  br i1 %q.any, label %part.begin, label %period.end
part.begin:
  %words = load i64, ptr %at
  %at.next = getelementptr i64, ptr %at, i64 %words
  %stages.at = getelementptr i64, ptr %at, i64 1
  %stages = load i64, ptr %stages.at
  br label %stage
stage:
  %s = phi i64 [ 0, %part.begin ], [ %s.next, %stage.run ]
  %missed.s = phi i64 [ %missed.p, %part.begin ], [ %missed.next, %stage.run ]
  %s.any = icmp slt i64 %s, %stages
  br i1 %s.any, label %stage.run, label %part.end
stage.run:
  %s.words = mul i64 %s, {ENTRY}
  %s.from = add i64 %s.words, {PART_HEAD}
  %entry = getelementptr i64, ptr %at, i64 %s.from
  %number = load i64, ptr %entry
  %memory.word.at = getelementptr i64, ptr %entry, i64 1
  %memory.word = load i64, ptr %memory.word.at
  %memory.at = getelementptr i64, ptr %at, i64 %memory.word
  %memory.own = ptrtoint ptr %memory.at to i64
  %of.inputs = icmp slt i64 %memory.word, 0
  %memory = select i1 %of.inputs, i64 %inputs, i64 %memory.own
  %constants.word.at = getelementptr i64, ptr %entry, i64 2
  %constants.word = load i64, ptr %constants.word.at
  %constants.at = getelementptr i64, ptr %at, i64 %constants.word
  %constants = ptrtoint ptr %constants.at to i64
  %tables.word.at = getelementptr i64, ptr %entry, i64 3
  %tables.word = load i64, ptr %tables.word.at
  %tables.at = getelementptr i64, ptr %at, i64 %tables.word
  %tables = ptrtoint ptr %tables.at to i64
  %function.at = getelementptr [{len(stages)} x ptr], ptr @birthsim_stages, i64 0, i64 %number
  %function = load ptr, ptr %function.at
  %missed.one = call i64 %function(i64 %world, i64 %seen, i64 %memory, i64 %constants, i64 %tables)
  %missed.next = add i64 %missed.s, %missed.one
  %s.next = add i64 %s, 1
  br label %stage
part.end:
  %q.next = add i64 %q, 1
  br label %part
period.end:
  %t.next = add i32 %t, 1
  br label %period
end:
  %missed = trunc i64 %missed.t to i32
  ret i32 %missed
}}
"""


def _wrapper(number: int, symbol: str) -> str:
    """A stage for one lane, without the status and the exception of a compiled kernel: stages raise none."""
    lanes = ", ".join(f"i64 {value}" for value in (0, 1))
    given = ", ".join(f"i64 %{k}" for k in range(STAGE_ARGUMENTS))
    types = ", ".join(["i64"] * ARGUMENTS)
    return f"""
declare i32 @"{symbol}"(ptr, ptr, {types})
define hidden i64 @birthsim_stage_{number}({given}) nounwind {{
  %missed = alloca i64
  %error = alloca ptr
  store i64 0, ptr %missed
  %status = call i32 @"{symbol}"(ptr %missed, ptr %error, {given}, {lanes})
  %value = load i64, ptr %missed
  ret i64 %value
}}"""
