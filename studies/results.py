"""Results: one JSON file a study, with what made it, and whether the sources are still those."""

from __future__ import annotations

import json
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from baselines.work.files import own_folder, whole_file
from baselines.work.sources import ROOT, hashes

RESULTS = ROOT / "results"
Rows = list[dict[str, str | float | None]]

LIBRARIES = ("numpy", "numba", "scipy", "gymnasium")


def measure(
    name: str, module: str, units: dict[str, str], seeds: Sequence[int], rows: Callable[[], Rows], folder: Path = RESULTS
) -> Path:
    """Write what ``rows()`` measures, whole, as the result of the study ``name``, whose code is ``module``.

    ``units`` has the unit of each column.
    """
    sources, commit = hashes(module), _git("rev-parse", "HEAD")
    dirty = bool(_git("status", "--porcelain", "--", ".", ":!results"))
    with own_folder(folder):
        began = time.perf_counter()
        found = rows()
        result = {
            "command": " ".join(("birthsim study", name, *sys.argv[1:])), "commit": commit, "dirty": dirty,
            "date": datetime.now(UTC).isoformat(timespec="seconds"), "seconds": round(time.perf_counter() - began, 1),
            "processor": _processor(),
            "versions": {"python": platform.python_version()} | {library: version(library) for library in LIBRARIES},
            "seeds": list(seeds), "units": units, "rows": found, "sources": sources,
        }  # fmt: skip
        path = folder / f"{name}.json"
        with whole_file(path) as file:
            file.write((json.dumps(result, indent=1, allow_nan=False) + "\n").encode())
    return path


def changed(name: str, module: str, folder: Path = RESULTS) -> list[str] | None:
    """Sources of ``module`` that changed, came or went since the result ``name`` was measured; None without one."""
    file = folder / f"{name}.json"
    if not file.is_file():
        return None
    then, now = json.loads(file.read_text())["sources"], hashes(module)
    return sorted(path for path in then.keys() | now.keys() if then.get(path) != now.get(path))


def _git(*arguments: str) -> str:
    return subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, capture_output=True, text=True).stdout.strip()


def _processor() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.is_file() else []
    return next((line.partition(": ")[2] for line in lines if line.startswith("model name")), platform.machine())
