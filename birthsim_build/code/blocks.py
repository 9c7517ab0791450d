"""A block of threads on a graphics processor: how many it has, and the memory that they share.

There a thread keeps the parameters of its lane while the plant is integrated (``birthsim_env.loop.integration``), in a column
of an array [parameter][thread]: threads side by side read words side by side, so that no two of them wait for the same bank.
"""

from birthsim_env.physics.compiled.lanes import PARAMETERS

WIDTH = 32
"""Threads of a block: a warp. Threads of a block need not wait for each other, so wider ones would gain nothing."""

SHARED = 8 * PARAMETERS * WIDTH
"""Bytes that a block shares. Below 48 kB code may have them without being asked. Eight blocks, which are all that registers
leave room for on a multiprocessor, take 141 of its 227 kB on an H100 or H200 with the kB that each block costs besides."""

_ARRAY = f"[{PARAMETERS} x [{WIDTH} x double]]"

_COLUMN_ON_DEVICE = f"""
@parameters = internal addrspace(3) global {_ARRAY} undef, align 8
define ptr @thread_column(ptr %room) alwaysinline nounwind {{
  %thread = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %number = zext i32 %thread to i64
  %at = getelementptr {_ARRAY}, ptr addrspace(3) @parameters, i64 0, i64 0, i64 %number
  %column = addrspacecast ptr addrspace(3) %at to ptr
  ret ptr %column
}}"""

_COLUMN_ELSEWHERE = """
define ptr @thread_column(ptr %room) alwaysinline nounwind {
  ret ptr %room
}"""


def block_code(device: bool) -> str:
    """LLVM code of what ``birthsim_env.physics.compiled.shared`` calls.

    A column: on a ``device`` that of the thread, elsewhere the first one of an array that the caller has made ``room`` for. And
    a zero of which LLVM does not know that it is one."""
    register = "l" if device else "r"
    return f"""{_COLUMN_ON_DEVICE if device else _COLUMN_ELSEWHERE}
define i64 @thread_nothing() alwaysinline nounwind {{
  %zero = call i64 asm sideeffect "", "={register},0"(i64 0) memory(inaccessiblemem: readwrite)
  ret i64 %zero
}}"""
