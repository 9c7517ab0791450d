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

from birthsim_build.image import Words

ONE_LANE = {
    **{"BIRTHSIM_BLOCK": "1", "NUMBA_LOOP_VECTORIZE": "0", "NUMBA_SLP_VECTORIZE": "0"},
    **{"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
}
"""Environment of the process that compiles for one lane, and not for the processor that it runs on."""


def compile_object(functions: Sequence[str], target: str, out: Path, data: Mapping[str, Words] | None = None) -> None:
    """Write the object file ``out`` of stages (``module:name``), ``birthsim_advance`` and constant arrays of words.

    Beside it stands the assembly, ``.s``.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "data.npz"
        np.savez(place, **dict(data or {}))  # type: ignore[arg-type]
        request = {"functions": list(functions), "target": target, "data": str(place), "out": str(out)}
        subprocess.run(
            [sys.executable, "-m", "birthsim_build.code.emit"], input=json.dumps(request), text=True, check=True,
            env={**os.environ, **ONE_LANE},
        )  # fmt: skip


def link(*arguments: str) -> None:
    """Run a linker of PyPI's ``ziglang``, ``wasm-ld`` or ``ld.lld``; ``ValueError`` where it is missing or refuses."""
    if find_spec("ziglang") is None:
        raise ValueError("linking needs the extra build: pip install 'birthsim[build]'")
    done = subprocess.run([sys.executable, "-m", "ziglang", *arguments], capture_output=True, text=True)
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise ValueError(f"{arguments[0]} fails: {said[0]}")
