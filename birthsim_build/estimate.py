"""How many processor cycles a law takes on a Cortex-M7: operations that it executes, times cycles that are assumed for each.

The law runs on this machine, on what sensors said in a closed loop, as code that counts its operations after all optimisation.
"""

import ctypes
from typing import Any

import numpy as np

from birthsim_build.bundle import Bundle, law_name, loop_name, make_bundle
from birthsim_build.code.compiler import EMULATIONS, compile_object, has_linker, link
from birthsim_build.code.counting import COUNTS, OPERATIONS
from birthsim_build.code.targets import HOST
from birthsim_build.image import HEAD, Words
from birthsim_build.layout import ROWS
from birthsim_env.files import temporary_folder
from birthsim_env.loop.rows import ASKED, WORLD
from birthsim_env.parts.scenarios import scenarios_for
from birthsim_env.physics.compiled.lanes import Array

CYCLES = {
    "sum": 4, "product": 4, "quotient": 30, "root": 30, "comparison": 3, "conversion": 40, "memory": 2, "whole": 1, "branch": 2,
    "call": 6,
}  # fmt: skip
"""Assumed, in double precision: ARM publishes none for a Cortex-M7. A conversion from or to 64 bits is a library call."""

PERIODS = 2000
"""Control periods that are counted: two seconds of the Circle, with its first push."""


def estimates(bundle: Bundle) -> dict[str, dict[str, float]]:
    """Of every law alone: operations and estimated cycles of a control period, the mean and the most.

    Empty without a linker, and on other hosts.
    """
    if HOST is None or not has_linker():
        return {}
    kinds = {sampled: "lab" if sampled else "ideal" for _, sampled in bundle.laws}
    scenario = scenarios_for(bundle.rig)[0]
    whole = make_bundle(bundle.rig, [scenario], kinds.values(), ())
    whole = Bundle(bundle.rig, whole.worlds, bundle.laws, None)
    images = whole.images()
    with temporary_folder() as folder:
        built, library = folder / "counting.o", folder / "counting.so"
        compile_object(whole.functions, HOST, built, count=True)
        link("ld.lld", "-m", EMULATIONS[HOST], "-shared", "-o", str(library), str(built))
        code: Any = ctypes.CDLL(str(library))
    found = {}
    for controller, sampled in bundle.laws:
        law = law_name(controller, sampled)
        seen = _seen(code, images[loop_name(scenario, kinds[sampled], controller)])
        counts = _counted(code, images[law], seen)
        cycles = counts @ np.array([CYCLES[kind] for kind in OPERATIONS])
        operations = float(counts.sum(axis=1).mean())
        found[law] = {"operations": operations, "cycles": float(cycles.mean()), "most": float(cycles.max())}
    return found


def _seen(code: Any, image: Words) -> Array:
    """What a law is handed in each period of a closed loop, (PERIODS, ASKED)."""
    loop, seen = image.copy(), np.empty((PERIODS, ASKED))
    for row in seen:
        row[:] = loop[HEAD + WORLD : HEAD + WORLD + ASKED].view(np.float64)
        code.birthsim_advance(ctypes.c_void_p(loop.ctypes.data), 1)
    return seen


def _counted(code: Any, image: Words, seen: Array) -> Array:
    """Operations of each kind in each period of a law alone, (PERIODS, kinds)."""
    counts = np.ctypeslib.as_array((ctypes.c_int64 * len(OPERATIONS)).in_dll(code, COUNTS))
    loop, found = image.copy(), np.empty((PERIODS, len(OPERATIONS)))
    rows = loop[HEAD : HEAD + ROWS].view(np.float64)
    for row, now in zip(found, seen, strict=True):
        rows[WORLD : WORLD + ASKED], counts[:] = now, 0
        code.birthsim_advance(ctypes.c_void_p(loop.ctypes.data), 1)
        row[:] = counts
    return found
