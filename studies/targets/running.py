"""Runs built loops: WebAssembly in Node, the shared library in this process, objects for other processors under qemu."""

import ctypes
import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_build.image import HEAD
from birthsim_build.layout import LAYOUT, ROWS
from birthsim_env.loop.rows import ASKED, WORLD
from birthsim_env.physics.compiled.lanes import Array

HERE = Path(__file__).resolve().parent
ROW = {row.name: row.number for row in LAYOUT}
"""Number of every row."""

EMULATED = {"aarch64": ("aarch64-linux-musl", "qemu-aarch64"), "cortex-m7": ("arm-linux-musleabihf", "qemu-arm")}
"""Target -> what zig links it with to run it here, and the program that runs it."""

Inputs = Mapping[str, Array]


def node_rows(
    folder: Path, make: list[Any], scratch: Path, periods: int, inputs: Inputs | None = None, exchange: Any = None
) -> tuple[Array, float]:
    """All rows after each control period (periods, ROWS), and control periods/s.

    ``make`` is a method of ``Bundle`` and its arguments; ``inputs`` name rows (periods,) to be set before; ``exchange``
    {"at", "controller", "sensors"} gives the law's place to another. Files go to the folder ``scratch``.
    """
    names, values = list(inputs or {}), np.array(list((inputs or {}).values()), dtype=np.float64)
    np.ascontiguousarray(values.T).tofile(scratch / "inputs.bin")
    request = {"folder": str(folder.resolve()), "make": make, "periods": periods, "names": names, "out": str(scratch)}
    line = ["node", str(HERE / "run.mjs"), json.dumps({**request, "exchange": exchange})]
    said = subprocess.run(line, check=True, capture_output=True, text=True).stdout
    return np.fromfile(scratch / "rows.bin").reshape(periods, ROWS), float(said)


def library_rows(folder: Path, name: str, periods: int, inputs: Inputs | None = None) -> Array:
    """All rows after each control period, (periods, ROWS), of the loop ``name`` in a shared library for this processor."""
    advance, loop = library_loop(folder, name)
    rows, kept = loop[HEAD : HEAD + ROWS].view(np.float64), np.empty((periods, ROWS))
    for period in range(periods):
        for row, values in (inputs or {}).items():
            rows[ROW[row]] = values[period]
        if missed := advance(loop.ctypes.data, 1):
            raise RuntimeError(f"{name} could not serve {missed} in period {period}")
        kept[period] = rows
    return kept


def library_loop(folder: Path, name: str) -> tuple[Any, Any]:
    """``birthsim_advance`` of a shared library, and the words of a loop where it begins."""
    code = ctypes.CDLL(str(folder / "libbirthsim.so"))
    code.birthsim_advance.argtypes, code.birthsim_advance.restype = [ctypes.c_void_p, ctypes.c_int32], ctypes.c_int32
    words = json.loads((folder / "build.json").read_text())["loops"][name] // 8
    return code.birthsim_advance, np.array((ctypes.c_int64 * words).in_dll(code, f"birthsim_{name}"))


def emulated_rows(target: str, folder: Path, name: str, periods: int, seen: Array | None = None) -> Array:
    """All rows after each control period, (periods, ROWS), of the object for another processor; ``seen`` (periods, ASKED)
    are given to it before."""
    system, program = EMULATED[target]
    given = (("LOOP", f"birthsim_{name}"), ("PERIODS", periods), ("FIRST", WORLD), ("COUNT", 0 if seen is None else ASKED))
    line = [sys.executable, "-m", "ziglang", "cc", "-target", system, "-static", "-O1", "-I", str(folder)]
    line += [*(f"-D{key}={value}" for key, value in given), str(HERE / "trace.c"), str(folder / "birthsim.o")]
    subprocess.run([*line, "-o", str(folder / "trace")], check=True)
    content = b"" if seen is None else np.ascontiguousarray(seen).tobytes()
    done = subprocess.run([program, str(folder / "trace")], input=content, check=True, capture_output=True)
    return np.frombuffer(done.stdout).reshape(periods, ROWS)
