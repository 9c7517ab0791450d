"""The machine code that the package carries: what is in it, that it serves, and that at a release all of it is fresh."""

import hashlib
import json
import os
import re
import subprocess
import sys

import pytest

from birthsim_build.code.elf import defined_in, undefined_in
from birthsim_build.kernels import freshness
from birthsim_build.kernels.freshness import stale
from birthsim_build.kernels.libraries import SHIPPED
from birthsim_build.kernels.wanted import declared
from birthsim_env.physics.compiled import prebuilt, sources
from tests.console import ROOT

INDEX = json.loads((prebuilt.FOLDER / "index.json").read_text(encoding="utf-8"))
RELEASED = re.search(r"^## \S+ \((.*)\)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)[1] != "unreleased"
STARTS = """
import sys, gymnasium, birthsim_env
for make in (gymnasium.make, lambda name, **how: gymnasium.make_vec(name, num_envs=3, **how)):
    env = make("BirthSIM/Circle-v2", sensors="lab", randomize=True)
    env.reset(seed=0)
    env.step(env.action_space.sample())
print([name for name in ("numba", "llvmlite", "scipy") if name in sys.modules])
"""


def test_the_folder_holds_what_the_index_says():
    files = {path.name for path in prebuilt.FOLDER.iterdir() if not path.name.startswith(".")}
    assert files == {*SHIPPED, "index.json", "sources.json"}
    hashes = {name: hashlib.sha256((prebuilt.FOLDER / name).read_bytes()).hexdigest() for name in SHIPPED}
    assert (INDEX["format"], INDEX["libraries"]) == (prebuilt.FORMAT, hashes)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_library_has_the_kernels_of_the_index_and_needs_memory_alone(name):
    content = (prebuilt.FOLDER / name).read_bytes()
    assert defined_in(content) == sorted(map(prebuilt.symbol_of, INDEX["kernels"]))
    assert set(undefined_in(content)) <= {"malloc", "free", "memset", "memcpy", "memmove"}
    # Nothing of the machine that built it.
    assert [word for word in (b"/work", b"/home", b"/root", b"/tmp", b"numba", b".py") if word in content] == []


def test_what_is_fresh_serves_and_at_a_release_all_is():
    """``make kernels`` renews what is stale, which Numba compiles until then."""
    left = stale()
    if prebuilt.target() in SHIPPED and prebuilt.USED:
        missing = [one.key for one in declared() if prebuilt.found(one.kernel, one.kinds)[0] is None]
        assert sorted(missing) == [key for key in sorted(missing) if key in left]
    assert not (RELEASED and left), f"{len(left)} kernels are stale: make kernels renews {', '.join(left)}"


def test_another_stamp_makes_a_kernel_stale(monkeypatch):
    before, edited = stale(), declared()[0].kernel.py_func
    stamp_of = sources.stamp_of
    monkeypatch.setattr(freshness, "stamp_of", lambda function: "edited" if function is edited else stamp_of(function))
    assert set(stale()) - {declared()[0].key} == set(before) - {declared()[0].key}
    assert declared()[0].key in stale()


def test_a_first_step_compiles_nothing(tmp_path):
    if prebuilt.target() not in SHIPPED:
        pytest.skip("no library runs here")
    if left := stale():
        pytest.skip(f"{len(left)} kernels are stale; make kernels renews {', '.join(left)}")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "BIRTHSIM_PREBUILT": "1", "BIRTHSIM_DEBUG": "0"}
    done = subprocess.run([sys.executable, "-c", STARTS], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip() == "[]"
    assert list(tmp_path.rglob("*.nbc")) == []
