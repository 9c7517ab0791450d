"""Compiles stages for one lane and writes an object file: a process of its own, since the kernels of this one are for blocks.

    python -m birthsim_build.code.emit <REQUEST.json

The request names functions (``module:name``), the target, data (an NPZ file of words by name), the object file, whether the
code counts its operations, what ``Threads`` has where threads run lanes, and the source of generated modules.
"""

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from birthsim_build.code.adjoints import backward
from birthsim_build.code.advance import advance_code
from birthsim_build.code.counting import counted
from birthsim_build.code.llvm_code import cleaned, head_of, hide, machine_of
from birthsim_build.code.targets import TARGETS, Target
from birthsim_build.code.threads import BACK, Threads, threads_code
from birthsim_env.gradients.source import module_of
from birthsim_env.loop.stage import compiled
from birthsim_env.physics.compiled.blocks import BLOCK

EXPORTED = "birthsim_"


def main() -> None:
    """Entry point."""
    request: dict[str, Any] = json.load(sys.stdin)
    if BLOCK != 1:
        raise RuntimeError(f"BIRTHSIM_BLOCK = {BLOCK}; allowed: 1")
    place, out = Path(request["data"]), Path(request["out"])
    for text in request["generated"]:
        module_of(text)
    threads = request["threads"] and Threads(*request["threads"])
    emit(request["functions"], TARGETS[request["target"]], place, out, request["count"], threads)


def emit(functions: list[str], target: Target, data: Path, out: Path, count: bool, threads: Threads | None) -> None:
    """Write the object of ``functions`` with what runs them and the constants of ``data``; for PTX, its text.

    Where it is to ``count``, the code counts its operations; where there are ``threads``, they run lanes.
    """
    machine = machine_of(target)
    head = head_of(target, machine)
    kernels = [_kernel_code(function) for function in (*functions, *(threads.adjoints if threads else ()))]
    symbols, on_device = [own for own, _ in kernels], target.triple.startswith("nvptx")
    if threads:
        modules = {BACK: backward.__module__}
        runs = [_kernel_code(f"{modules.get(name, threads_code.__module__)}:{name}") for name in threads.runs]
        entry = threads_code(threads, symbols, [own for own, _ in runs], on_device)
    else:
        runs = [_kernel_code(f"{advance_code.__module__}:advance")]
        entry = advance_code(symbols, runs[0][0])
    module = llvm.parse_assembly(head + entry + _constants(data))
    for _, code in [*runs, *kernels]:
        module.link_in(llvm.parse_assembly(head + code))
    hide(module, EXPORTED)
    tuning = llvm.create_pipeline_tuning_options(speed_level=3)
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    module.verify()
    if count:
        module = llvm.parse_assembly(counted(str(module)))
    if target.triple.startswith("thumb"):
        out.with_suffix(".s").write_text(machine.emit_assembly(module))
    if on_device:
        out.with_suffix(".ptx").write_text(machine.emit_assembly(module))
    else:
        out.write_bytes(machine.emit_object(module))


def _kernel_code(function: str) -> tuple[str, str]:
    """Symbol and LLVM code of the kernel ``module:name``, without what belongs to this processor or to Python."""
    module, _, name = function.partition(":")
    made = compiled(getattr(import_module(module), name))
    return made.fndesc.mangled_name, cleaned(str(made.library._get_module_for_linking()))


def _constants(data: Path) -> str:
    with np.load(data) as arrays:
        return "\n".join(
            f"@{name} = constant [{len(words)} x i64] [{', '.join(f'i64 {word}' for word in words)}], align 8"
            for name, words in arrays.items()
        )


if __name__ == "__main__":
    main()
