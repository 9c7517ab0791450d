"""Stages as one WebAssembly module that exports each of them by name and takes its memory from outside.

Numba's LLVM code of a stage is aimed at wasm32 by llvmlite; what of it only Python needs is never called and falls away.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding as llvm

from birthsim_env.loop.stage import SIGNATURE

TRIPLE = "wasm32-unknown-unknown"
SQUARE_ROOT = "double @llvm.sqrt.f64"
STACK = 256 * 1024
"""Bytes; the largest stage takes a tenth."""


def module_of(functions: Mapping[str, Callable[..., int]]) -> bytes:
    """The module with the stages ``functions``, by the names that it exports."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(opt=3, reloc="static", features="+simd128,+bulk-memory")
    with tempfile.TemporaryDirectory() as folder:
        objects = []
        for name, function in functions.items():
            objects.append(Path(folder) / f"{name}.o")
            objects[-1].write_bytes(_object(name, function, machine))
        made = Path(folder) / "loop.wasm"
        exports = [f"--export={name}" for name in functions]
        line = [*_linker(), "--no-entry", "--import-memory", "--strip-all", "-z", f"stack-size={STACK}", *exports]
        subprocess.run([*line, "--export=__heap_base", *map(str, objects), "-o", str(made)], check=True)
        return made.read_bytes()


def _object(name: str, function: Any, machine: Any) -> bytes:
    compiled = numba.cfunc(SIGNATURE, error_model="numpy")(function.py_func)  # type: ignore[no-untyped-call]
    text = re.sub(r"^target .*\n", "", compiled.inspect_llvm(), flags=re.M)
    text = re.sub(r'"target-(cpu|features)"="[^"]*"', "", text)
    text = text.replace(compiled._wrapper_name, name).replace("= common ", "= internal ")
    # IEEE's square root, as an instruction rather than a call.
    text = re.sub(r"^declare .*@(llvm\.)?sqrt(\.f64)?\(double.*\n", "", text, flags=re.M).replace("double @sqrt(", f"{SQUARE_ROOT}(")
    text = f"{text}\ndeclare {SQUARE_ROOT}(double)\n"
    module = llvm.parse_assembly(f'target datalayout = "{machine.target_data}"\ntarget triple = "{TRIPLE}"\n{text}')
    for own in module.functions:
        if not own.is_declaration and own.name != name:
            own.linkage = "internal"
    passes = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes.getModulePassManager().run(module, passes)
    missing = [own.name for own in module.functions if own.is_declaration and not own.name.startswith("llvm.")]
    if missing:
        raise ValueError(f"stage {name} calls {', '.join(missing)}; allowed: + - * / sqrt and what is made of them")
    return bytes(machine.emit_object(module))


def _linker() -> list[str]:
    for name in ("wasm-ld", *(f"wasm-ld-{version}" for version in range(22, 13, -1))):
        if found := shutil.which(name):
            return [found]
    return [sys.executable, "-m", "ziglang", "wasm-ld"]
