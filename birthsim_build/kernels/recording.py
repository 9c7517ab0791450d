"""Walks the users' paths, each in a process of its own, and records which kernels they ask for.

    python -m birthsim_build.kernels.recording NAME FOLDER

is that process. What a path asks for does not depend on what is found; the library that is there makes it fast.
"""

import json
import os
import runpy
import subprocess
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from birthsim_env.files import make_folder, temporary_folder, write_json
from birthsim_env.gradients.source import TEXTS
from birthsim_env.physics.compiled import prebuilt
from birthsim_env.physics.compiled.sources import is_ours

LIBRARY = "BIRTHSIM_FIRST_LIBRARY"
"""Variable with the folder of the library that paths go on."""


def record(paths: Iterable[str], library: Path, work: Path) -> tuple[list[str], list[str]]:
    """Keys of the kernels that ``paths`` ask for, and the sources of the modules that they generate."""
    keys, texts = set[str](), set[str]()
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for found in pool.map(lambda name: _walked(name, library, _kept(work / name)), paths):
            keys |= set(found["keys"])
            texts |= set(found["texts"])
    return sorted(keys), sorted(texts)


def _walked(name: str, library: Path, kept: Path) -> dict[str, list[str]]:
    own = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "BIRTHSIM_"))}
    environment = {**own, LIBRARY: str(library), "NUMBA_CACHE_DIR": str(kept)}
    with temporary_folder() as folder:
        line = [sys.executable, "-m", __name__, name, str(folder)]
        done = subprocess.run(line, capture_output=True, text=True, errors="replace", env=environment)
        if done.returncode:
            raise RuntimeError(f"the path {name} ends with {done.returncode}: {done.stderr.strip()[-2000:]}")
        found: dict[str, list[str]] = json.loads((folder / "asked.json").read_text(encoding="utf-8"))
    return found


def _kept(folder: Path) -> Path:
    """The folder of what a path keeps, with machine code alone: for what else is kept it would ask no more."""
    for path in make_folder(folder).iterdir():
        if path.is_file() and path.suffix != ".nbc":
            path.unlink()
    return folder


def main(name: str, folder: Path) -> None:
    """Walk one path."""
    asked, found = set[str](), prebuilt.found

    def noted(kernel: Any, kinds: Sequence[str]) -> tuple[Any, str]:
        asked.add(prebuilt.key_of(kernel, kinds))
        return found(kernel, kinds)

    prebuilt.found, prebuilt.FOLDER = noted, Path(os.environ[LIBRARY])
    walk(name, folder)
    texts = {module: text for module, text in TEXTS.items() if any(key.startswith(f"{module}.") for key in asked)}
    keys = sorted(key for key in asked if is_ours(key) or key.partition(".")[0] in texts)
    # A kind that no key can name ends with what Numba makes of it.
    known = [key for key in keys if "?" not in key]
    write_json(folder / "asked.json", {"keys": known, "texts": sorted(texts.values())})


def walk(name: str, folder: Path) -> None:
    """Walk one path; what it writes goes to ``folder``."""
    from birthsim_build.kernels.paths import PATHS  # late: modules ask for kernels as they are imported

    path = PATHS[name]
    if not isinstance(path, tuple):
        path()
        return
    sys.argv = ["birthsim", *(word.format(out=folder) for word in path)]
    try:
        runpy.run_module("birthsim", run_name="__main__")
    except SystemExit as end:
        if end.code:
            raise


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
