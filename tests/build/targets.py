"""Runs built loops, and the same in Python."""

from __future__ import annotations

import ctypes
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines.registry import make_controller
from birthsim_build.bundle import identifier
from birthsim_build.image import HEAD
from birthsim_build.layout import LAYOUT, ROWS
from birthsim_env import Parameters
from birthsim_env.loop.rows import ASKED, IMPACT, OPENING, SEEN, WORLD
from birthsim_env.parts.scenarios import environment_id

HERE = Path(__file__).parent
ROW = {row.name: row.number for row in LAYOUT}
BUILT = ("--controller", "admittance-backstepping", "--policy", "circle", "--sensors", "ideal", "lab")
STEPS, PERIODS = 200, 2000
"""Policy steps of the comparisons, and control periods in them."""
SHARED = [*range(IMPACT), *range(IMPACT + 2, WORLD + ASKED), *range(WORLD + OPENING, WORLD + OPENING + 4)]
"""Rows that are compared: all of the world and of what is measured, asked for and commanded. Impacts begin anew in Python."""


def need(there, reason):
    """Skip where a tool is missing; under CI fail."""
    if not there:
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)(reason)


def need_linker():
    need(importlib.util.find_spec("ziglang"), "ziglang is missing: pip install 'birthsim[build]'")


def build(target, folder, *options):
    line = [sys.executable, "-m", "birthsim_build.commands.build", target, *options, "--out", str(folder)]
    subprocess.run(line, check=True, capture_output=True, text=True)


def python_rows(scenario, sensors, controller, periods=PERIODS):
    """All rows of world and seen (periods, WORLD + SEEN) of the nominal scenario under a controller."""
    rig = Parameters()
    period = rig.electronics.control_period
    env = gymnasium.make_vec(environment_id(scenario), num_envs=1, sensors=sensors, policy_period=period)
    env.reset(seed=0)
    kind, _, policy = controller.partition(":")
    law, simulation = make_controller(kind, rig, **({"policy": policy} if policy else {})), env.unwrapped.simulation
    rows = np.empty((periods, WORLD + SEEN))
    for row in rows:
        simulation.step(np.ascontiguousarray(law.command(simulation.measurement, simulation.reference)))
        row[:] = np.concatenate(simulation.rows())[:, 0]
    return rows


def node_rows(folder, make, out, periods=PERIODS, inputs=None):
    """All rows (periods, ROWS) in Node: ``make`` is a method of Bundle and its arguments; ``inputs`` name -> (periods,)."""
    need(shutil.which("node"), "node is missing: apt-get install nodejs")
    names, values = list(inputs or {}), np.array(list((inputs or {}).values())).T
    np.ascontiguousarray(values).tofile(out / "inputs.bin")
    request = {"folder": str(folder), "make": make, "periods": periods, "names": names, "out": str(out)}
    subprocess.run(["node", str(HERE / "run.mjs"), json.dumps(request)], check=True, capture_output=True, text=True)
    return np.fromfile(out / "rows.bin").reshape(periods, ROWS)


def library_rows(folder, name, words, periods=PERIODS, inputs=None):
    """All rows (periods, ROWS) of the loop ``name`` in the shared library."""
    library = ctypes.CDLL(str(folder / "libbirthsim.so"))
    advance = library.birthsim_advance
    advance.argtypes, advance.restype = [ctypes.c_void_p, ctypes.c_int32], ctypes.c_int32
    loop = np.array((ctypes.c_int64 * words).in_dll(library, f"birthsim_{name}"))
    rows, kept = loop[HEAD : HEAD + ROWS].view(np.float64), np.empty((periods, ROWS))
    for period in range(periods):
        for row, values in (inputs or {}).items():
            rows[ROW[row]] = values[period]
        assert advance(loop.ctypes.data, 1) == 0
        kept[period] = rows
    return kept


def loop_name(scenario, sensors, controller):
    return f"{scenario}_{sensors}_{identifier(controller)}"


def assert_same_bits(one, other):
    differs = np.ascontiguousarray(one).view(np.int64) != np.ascontiguousarray(other).view(np.int64)
    assert not differs.any(), f"first in period {differs.any(axis=1).argmax()}, columns {np.flatnonzero(differs.any(axis=0))}"
