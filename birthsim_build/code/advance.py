"""What runs an image: a kernel over its parts, and ``birthsim_advance``, by which C and JavaScript call it."""

from collections.abc import Sequence

import numpy as np

from birthsim_build.image import ENTRY, HEAD, LEFT_OUT, PART_HEAD, Words
from birthsim_build.layout import ROWS, Inputs
from birthsim_env.loop.rows import WORLD
from birthsim_env.loop.stage import ARGUMENTS, call, carray, pointer
from birthsim_env.physics.compiled.compilation import helper, kernel

STAGE_ARGUMENTS = 5
"""Addresses of world, seen, memory, constants and tables: the lane is 0 and one alone."""


@helper
def words(address: int, count: int) -> Words:
    """Words at an address."""
    return carray(pointer(address, np.int64), (count,))


@kernel
def advance(image: int, periods: int, dispatch: int) -> int:
    """Run control periods of the image at an address; returns how many stages could not serve.

    ``dispatch`` is the address of what calls a stage by its number. Before the first period the addresses of tables are put
    into their descriptions, so that an image may have been copied.
    """
    parts, rows, missed, left_out = words(image, HEAD)[2], image + 8 * HEAD, 0, words(image, HEAD)[LEFT_OUT]
    seen, inputs, first = rows + 8 * WORLD, rows + 8 * (ROWS - Inputs.size), rows + 8 * ROWS
    part = first
    for _ in range(parts):
        size, stages, tables, _ = words(part, PART_HEAD)
        for k in range(tables):
            described, table = words(part + 8 * (PART_HEAD + ENTRY * stages + 2 * k), 2)
            words(part + 8 * described, 1)[0] = part + 8 * table
        part += 8 * size
    for _ in range(periods):
        part = first
        for p in range(parts):
            size, stages, _, _ = words(part, PART_HEAD)
            for s in range(0 if (left_out >> p) & 1 else stages):
                number, memory, constants, tables = words(part + 8 * (PART_HEAD + ENTRY * s), ENTRY)
                own = inputs if memory < 0 else part + 8 * memory
                missed += call(dispatch, number, rows, seen, own, part + 8 * constants, part + 8 * tables, 0)
            part += 8 * size
    return missed


def advance_code(stages: Sequence[str], kernel: str) -> str:
    """LLVM code of ``int32_t birthsim_advance(int64_t *image, int32_t periods)``; ``stages`` are symbols of compiled kernels,
    ``kernel`` is that of ``advance``."""
    wrappers = "\n".join(wrapper(number, symbol) for number, symbol in enumerate(stages))
    pointers = ", ".join(f"ptr @birthsim_stage_{number}" for number in range(len(stages)))
    given = ", ".join(f"i64 %{k}" for k in range(1, 1 + STAGE_ARGUMENTS))
    return f"""
{wrappers}
@birthsim_stages = internal constant [{len(stages)} x ptr] [{pointers}]
define internal i64 @dispatch(i64 %0, {given}, i64 %unused) nounwind {{
  %at = getelementptr [{len(stages)} x ptr], ptr @birthsim_stages, i64 0, i64 %0
  %function = load ptr, ptr %at
  %missed = call i64 %function({given})
  ret i64 %missed
}}
declare i32 @"{kernel}"(ptr, ptr, i64, i64, i64)
define i32 @birthsim_advance(ptr noundef %image, i32 noundef %periods) nounwind {{
  %missed = alloca i64
  %error = alloca ptr
  %address = ptrtoint ptr %image to i64
  %count = sext i32 %periods to i64
  %status = call i32 @"{kernel}"(ptr %missed, ptr %error, i64 %address, i64 %count, i64 ptrtoint (ptr @dispatch to i64))
  %all = load i64, ptr %missed
  %value = trunc i64 %all to i32
  ret i32 %value
}}
"""


def wrapper(number: int, symbol: str, lane: str = "i64 0") -> str:
    """A stage for one lane, a constant or an argument, without the status and the exception of a compiled kernel: stages raise
    none."""
    lanes, own = f"{lane}, i64 1", lane.startswith("i64 %")
    given = ", ".join(f"i64 %{k}" for k in range(STAGE_ARGUMENTS))
    types = ", ".join(["i64"] * ARGUMENTS)
    return f"""
declare i32 @"{symbol}"(ptr, ptr, {types})
define {"internal" if own else "hidden"} i64 @birthsim_stage_{number}({given}{f", {lane}" if own else ""}) nounwind {{
  %missed = alloca i64
  %error = alloca ptr
  store i64 0, ptr %missed
  %status = call i32 @"{symbol}"(ptr %missed, ptr %error, {given}, {lanes})
  %value = load i64, ptr %missed
  ret i64 %value
}}"""
