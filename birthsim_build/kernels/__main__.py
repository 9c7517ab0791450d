"""``make kernels``: builds what the package carries of machine code.

    python -m birthsim_build.kernels                  into birthsim_env/prebuilt
    python -m birthsim_build.kernels --every          libraries for Windows and macOS too, into out/kernels/every
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.kernels.libraries import LIBRARIES, SHIPPED
from birthsim_env.physics.compiled import prebuilt

WORK = Path("out") / "kernels"
"""Where objects are kept."""

ENVIRONMENT = {
    **{"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(WORK / "compiled")},
    **{"PYTHONHASHSEED": "0", "BIRTHSIM_PREBUILT": "0", "BIRTHSIM_DEBUG": "0", "BIRTHSIM_BLOCK": str(prebuilt.LANES)},
}
"""Of the process that builds, so that its bytes depend on sources and versions alone."""


def main() -> int:
    """Entry point; the exit status."""
    asked = argparse.ArgumentParser(prog="make kernels", description="Build prebuilt kernels.")
    asked.add_argument("--every", action="store_true", help="libraries for Windows and macOS too, into out/kernels/every")
    every = asked.parse_args().every
    if any(os.environ.get(name) != value for name, value in ENVIRONMENT.items()):
        return subprocess.run([sys.executable, "-m", "birthsim_build.kernels", *sys.argv[1:]], env={**os.environ, **ENVIRONMENT}).returncode
    require_llvm()
    require_linker()
    from birthsim_build.kernels.building import build  # late: in this environment alone

    began = time.perf_counter()
    out = WORK / "every" if every else prebuilt.FOLDER
    made = build(out, list(LIBRARIES) if every else SHIPPED, WORK)
    sizes = ", ".join(f"{path.name} {path.stat().st_size / 1e3:.0f} kB" for path in sorted(out.iterdir()))
    print(f"{len(made)} kernels in {time.perf_counter() - began:.0f} s: {out}: {sizes}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
