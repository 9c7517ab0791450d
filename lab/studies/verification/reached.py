"""Lines and branches of physics and laws that tests reach, with the kernels as plain Python.

    birthsim study verification coverage

Machine code hides its lines from ``coverage``. The tests are those that the mutation tester found quick enough uncompiled.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each, Listed
from lab.engine.results import MOST
from lab.studies.mutation.modules import MODULES
from lab.studies.mutation.uncompiled import SETTINGS, switch_off
from lab.studies.verification import sources


def measure() -> dict[str, Any]:
    """Coverage of every module with a mutation score, by the union of their tests, in a process of its own."""
    stored, started = sources.load("mutation"), time.monotonic()
    tests = sorted({test for module in stored.values() for test in module["tests"]})
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder)
        (there / "tests.json").write_text(json.dumps(tests), encoding="utf-8")
        line = [sys.executable, "-m", "lab.studies.verification.reached", folder]
        done = subprocess.run(
            line, cwd=sources.ROOT, env={**os.environ, **SETTINGS}, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(f"tests uncompiled ended with {done.returncode}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
        files = read_json("coverage", there / "coverage.json", {"files": Each(dict)}, MOST)["files"]
    found = {}
    for path in map(sources.path_of, MODULES):
        total = files[path]["summary"]
        found[path] = {
            "lines": total["num_statements"], "lines_missed": files[path]["missing_lines"],
            "branches": total["num_branches"], "branches_missed": files[path]["missing_branches"],
        }  # fmt: skip
    return {"tests": len(tests), "seconds": round(time.monotonic() - started), "files": found}


def main(folder: Path) -> int:
    """Run the tests named in ``tests.json`` uncompiled and write ``coverage.json`` beside it."""
    import coverage

    paths = [sources.path_of(module) for module in MODULES]
    watch = coverage.Coverage(data_file=None, branch=True, include=paths, messages=False)
    watch.start()
    switch_off()
    import pytest

    tests = read_json("tests", folder / "tests.json", Listed(str))
    status = pytest.main(["-q", "--tb=short", "--no-header", "-p", "no:xdist", "-p", "no:cacheprovider", *tests])
    watch.stop()
    watch.json_report(outfile=str(folder / "coverage.json"))
    return int(status)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
