"""On users' paths nothing is compiled, and what compiles, computes or draws for others is not imported."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from birthsim_build.kernels.paths import PATHS
from birthsim_env.physics.compiled import prebuilt

ROOT = Path(__file__).parents[2]

LATE = {"numba", "llvmlite", "scipy", "matplotlib", "pygame"}
NEEDS = {"figure4": {"matplotlib", "pygame"}, "evaluate": {"matplotlib"}, "controllers": {"scipy"}}
"""What paths need of these: pictures that they end with, and the equation of LQR."""

PROGRAM = """
import json, sys
from pathlib import Path
from birthsim_build.kernels.recording import walk
from birthsim_env.physics.compiled import prebuilt

find, missed = prebuilt.found, set()

def noted(kernel, kinds):
    found = find(kernel, kinds)
    if found[0] is None:
        missed.add(prebuilt.key_of(kernel, kinds))
    return found

prebuilt.found = noted
walk(sys.argv[1], Path(sys.argv[2]))
_, kernels = prebuilt._opened()
print(json.dumps([sorted(kernels), sorted(missed), sorted(sys.modules)]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("path", PATHS)
def test_nothing_is_compiled(path, tmp_path):
    usual = {"BIRTHSIM_PREBUILT": "1", "BIRTHSIM_DEBUG": "0", "BIRTHSIM_BLOCK": str(prebuilt.LANES)}
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **usual}
    line = [sys.executable, "-c", PROGRAM, path, str(tmp_path)]
    done = subprocess.run(line, env=environment, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    kernels, missed, modules = json.loads(done.stdout.splitlines()[-1])
    if not kernels:
        pytest.skip("there is no machine code for this processor")
    if set(kernels) & set(missed):
        pytest.skip("kernels were edited since `make kernels`, and Numba compiles them")
    assert missed == []
    assert LATE & set(modules) == NEEDS.get(path, set())
