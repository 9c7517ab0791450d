"""Studies that need a process whose packages are imported under settings of their own."""

from __future__ import annotations

import os
import sys

ONE_THREAD = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def begin(module: str, settings: dict[str, str]) -> None:
    """Go on as ``python -m module`` with the same arguments and these variables; imports of this process are gone."""
    os.execve(sys.executable, [sys.executable, "-m", module, *sys.argv[1:]], os.environ | settings)
