"""Objects for a target, made in a process of their own; and the linker of PyPI's ``ziglang``."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from llvmlite.binding import llvm_version_info

from birthsim_build.image import Words

ONE_LANE = {
    **{"BIRTHSIM_BLOCK": "1", "NUMBA_LOOP_VECTORIZE": "0", "NUMBA_SLP_VECTORIZE": "0"},
    **{"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
}
"""Environment of the process that compiles for one lane, and not for the processor that it runs on."""


LEAST_LLVM = 22
"""LLVM 20 gives ``baselines.estimation.observers.observe`` other bits once the function is local to the code; LLVM 21 is
untried."""

EMULATIONS = {"x86-64": "elf_x86_64", "aarch64": "aarch64linux"}
"""Targets with shared libraries -> what the linker calls them."""


def compile_object(
    functions: Sequence[str], target: str, out: Path, data: Mapping[str, Words] | None = None, count: bool = False
) -> None:
    """Write the object file ``out`` of stages (``module:name``), ``birthsim_advance`` and constant arrays of words.

    For a Cortex-M7 the assembly stands beside it, ``.s``. Where it is to ``count``, the code counts its operations.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "data.npz"
        np.savez(place, **dict(data or {}))  # type: ignore[arg-type]
        request = {"functions": list(functions), "target": target, "data": str(place), "out": str(out), "count": count}
        subprocess.run(
            [sys.executable, "-m", "birthsim_build.code.emit"], input=json.dumps(request), text=True, check=True,
            env={**os.environ, **ONE_LANE},
        )  # fmt: skip


def has_linker() -> bool:
    """Whether PyPI's ``ziglang`` is there."""
    return find_spec("ziglang") is not None


def require_llvm() -> None:
    """Raises ``ValueError`` for an LLVM before ``LEAST_LLVM``."""
    if llvm_version_info[0] < LEAST_LLVM:
        found = ".".join(map(str, llvm_version_info))
        raise ValueError(f"llvmlite has LLVM {found}; allowed: {LEAST_LLVM} or later, llvmlite 0.50")


def require_linker() -> None:
    """Raises ``ValueError`` where PyPI's ``ziglang`` is missing."""
    if not has_linker():
        raise ValueError("linking needs the extra build: pip install 'birthsim[build]'")


def link(*arguments: str) -> None:
    """Run a linker of PyPI's ``ziglang``, ``wasm-ld`` or ``ld.lld``; ``ValueError`` where it refuses."""
    done = subprocess.run([sys.executable, "-m", "ziglang", *arguments], capture_output=True, text=True)
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise ValueError(f"{arguments[0]} fails: {said[0]}")
