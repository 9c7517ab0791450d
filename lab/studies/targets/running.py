"""Runs built loops: WebAssembly in Node, a library and threads in this process, objects for other processors under qemu."""

import ctypes
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_build.bundle import loop_name
from birthsim_build.code.blocks import WIDTH
from birthsim_build.code.threads import Threads
from birthsim_build.code.tools import run_tool
from birthsim_build.device.export import write_programs
from birthsim_build.device.machine import Host
from birthsim_build.image import HEAD
from birthsim_build.layout import LAYOUT, ROWS
from birthsim_env.loop.rows import ASKED, WORLD
from birthsim_env.loop.world import Start
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

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
    run_tool(*line, "-o", str(folder / "trace")).check_returncode()
    content = b"" if seen is None else np.ascontiguousarray(seen).tobytes()
    done = subprocess.run([program, str(folder / "trace")], input=content, check=True, capture_output=True)
    return np.frombuffer(done.stdout).reshape(periods, ROWS)


def thread_rows(loops: Sequence[tuple[str, str, str]], rig: Parameters, folder: Path, periods: int) -> Iterator[Array]:
    """Per loop (scenario, sensors, controller) all rows that a lane has after each control period, (periods, ROWS), else NaN.

    They are those of the first lane of a second block of a graphics processor's threads, whose code this processor runs.
    """
    functions, space, _ = write_programs(loops, rig, folder)
    run, lanes = Host().load(tuple(functions), Threads(space)), WIDTH + 1
    starts = np.concatenate([[np.arange(lanes)], np.zeros((Start.size, lanes), dtype=np.int64)])
    for scenario, sensors, controller in loops:
        name = loop_name(scenario, sensors, controller)
        words, about = np.fromfile(folder / f"{name}.bin", dtype=np.int64), json.loads((folder / f"{name}.json").read_text())
        data, kept = np.zeros((about["words_of_data"], lanes)), np.full((periods, ROWS), np.nan)
        own = [(ROW[row], at) for row, at in about["rows"].items() if row in ROW]
        numbers, places = map(list, zip(*own, strict=True))
        run("place", 1, words.ctypes.data, data.ctypes.data, lanes)
        run("begin", lanes, words.ctypes.data, starts.ctypes.data, lanes)
        for row in kept:
            run("advance", lanes, words.ctypes.data, 1, 0)
            row[numbers] = data[places, WIDTH]
        yield kept
