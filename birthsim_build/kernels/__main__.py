"""``make kernels``: builds the machine code that the package carries, ``birthsim_env/prebuilt``.

It is built anew at a release. With ``--check`` it fails where there were other bytes of the same sources; with ``--every``
libraries for Windows and macOS are built too, into ``out/kernels/every``.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

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
    parser = argparse.ArgumentParser(prog="python -m birthsim_build.kernels", description="Build prebuilt kernels.")
    parser.add_argument("--check", action="store_true", help="fail where there were other bytes of the same sources")
    parser.add_argument("--every", action="store_true", help=f"libraries for Windows and macOS too, into {WORK / 'every'}")
    asked = parser.parse_args()
    if any(os.environ.get(name) != value for name, value in ENVIRONMENT.items()):
        line = [sys.executable, "-m", "birthsim_build.kernels", *sys.argv[1:]]
        return subprocess.run(line, env={**os.environ, **ENVIRONMENT}).returncode
    require_llvm()
    require_linker()
    from birthsim_build.kernels.building import build  # late: it loads Numba, and in this environment alone

    began, out = time.perf_counter(), WORK / "every" if asked.every else prebuilt.FOLDER
    before = _index(out)
    build(out, list(LIBRARIES) if asked.every else SHIPPED, WORK)
    after = _index(out)
    kernels = after["kernels"].items()
    renewed = [key for key, about in kernels if before["kernels"].get(key) != about]
    sizes = ", ".join(f"{name} {(out / name).stat().st_size / 1e3:.0f} kB" for name in after["libraries"])
    print(f"{out}: {len(kernels)} kernels, {len(renewed)} of them renewed, in {time.perf_counter() - began:.0f} s; {sizes}")
    if asked.check and before["kernels"] == after["kernels"] and before["libraries"] != after["libraries"]:
        print(f"{out} had other bytes of the same sources; allowed: those of make kernels with constraints.txt's versions")
        return 1
    return 0


def _index(folder: Path) -> Any:
    place = folder / "index.json"
    return json.loads(place.read_bytes()) if place.is_file() else {"kernels": {}, "libraries": {}}


if __name__ == "__main__":
    raise SystemExit(main())
