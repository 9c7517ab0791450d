"""The plant's twin: its right-hand side and integrator written by hand in C (``twin.c``), compiled where it is wanted."""

import ctypes
import shutil
from pathlib import Path

import numpy as np

from birthsim_build.code.tools import run_tool
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, STATE_NAMES, Array

SOURCE = Path(__file__).with_name("twin.c")
OPTIMISED = ("-O3", "-march=native", "-ffast-math")
PLAIN = ("-O3", "-march=native")
"""Options of gcc: as fast as it can, and with every operation as written (but for fused products and sums)."""

LEFT_OUT: dict[str, str] = {}
"""Parameters that ``dynamics`` computes with and the twin does not, and why not."""


def has_compiler() -> bool:
    """Whether gcc is there."""
    return shutil.which("gcc") is not None


def rows_header() -> str:
    """C names for the rows of states and parameters: those of ``birthsim_env.physics.compiled.lanes`` in capitals."""
    tables = ((*names, last) for names, last in ((STATE_NAMES, "states"), (PARAMETER_NAMES, "parameters")))
    return "".join(f"enum {{ {', '.join(name.upper() for name in table)} }};\n" for table in tables)


class Twin:
    """The twin compiled in ``folder`` with ``options`` of gcc; raises ``ValueError`` with gcc's words where that fails."""

    def __init__(self, folder: Path, options: tuple[str, ...] = OPTIMISED) -> None:
        (folder / "rows.h").write_text(rows_header())
        compiled, library = folder / "twin.o", folder / "twin.so"
        _gcc(*options, "-std=c17", "-fPIC", f"-I{folder}", "-c", str(SOURCE), "-o", str(compiled))
        # Linked with -ffast-math, a library of older gcc would flush denormal numbers in the whole process that loads it.
        _gcc("-shared", str(compiled), "-lm", "-o", str(library))
        self._advance = ctypes.CDLL(str(library)).advance
        matrix = np.ctypeslib.ndpointer(np.float64, 2, flags="C_CONTIGUOUS")
        samples = np.ctypeslib.ndpointer(np.float64, 3, flags="C_CONTIGUOUS")
        counts = (ctypes.c_long, ctypes.c_long, ctypes.c_long)
        self._advance.argtypes = (matrix, matrix, samples, matrix, matrix, *counts, ctypes.c_double)
        self._advance.restype = None

    def advance(
        self, state: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, impacts: Array
    ) -> None:
        """``birthsim_env.physics.dynamics.advance``, with the same arguments."""
        self._advance(state, command, forces, parameters, impacts, state.shape[1], forces.shape[0], steps, step)


def _gcc(*arguments: str) -> None:
    done = run_tool("gcc", *arguments)
    if done.returncode:
        raise ValueError(f"gcc {' '.join(arguments)}: {done.stderr.strip()}")
