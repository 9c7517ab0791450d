"""Compiled code is never stale, and no cache file, disk or home directory is needed to compile."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from birthsim_env.physics.compiled import kept as kept_on_disk
from birthsim_env.physics.compiled import sources
from birthsim_env.physics.compiled.sources import dependencies, imports, source, source_stamp

ROOT = Path(__file__).parents[3]
PROBE = """
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.loop.signals import compliance

@kernel
def displaced(force, x):
    x[0] = compliance(force, 0.0, 2000.0, 2000.0, 0.0)[0]
"""
PROGRAM = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
import numpy as np
from birthsim_env.probe import displaced
x = np.zeros(1)
displaced(10.34, x)
print(1e3 * x[0])
"""


@pytest.fixture
def package(tmp_path):
    """A copy of the few modules that one small kernel needs."""
    folder = tmp_path / "birthsim_env"
    for path in dependencies([ROOT / "birthsim_env" / name for name in ("loop/signals.py", "physics/compiled/compilation.py")]):
        if path.name != "__init__.py":
            (tmp_path / path.relative_to(ROOT)).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, tmp_path / path.relative_to(ROOT))
    for room in (folder, *(path for path in folder.rglob("*") if path.is_dir())):
        (room / "__init__.py").touch()
    (folder / "probe.py").write_text(PROBE)
    return folder


def displaced(package, largest_file=10**9):
    """What the kernel computes in a process of its own, mm, and whether it was compiled there."""
    line = [sys.executable, "-c", PROGRAM, str(largest_file)]
    environment = {**os.environ, "PYTHONPATH": str(package.parent)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(line, cwd=package.parent, env=environment, capture_output=True, text=True, check=True)
    return float(done.stdout), "compiling" in done.stderr


@pytest.mark.slow
def test_a_changed_helper_in_another_file_is_compiled_anew_and_nothing_else(package):
    assert displaced(package) == (pytest.approx(5.17), True)
    assert displaced(package) == (pytest.approx(5.17), False)
    (package / "probe.py").write_text(f"# A comment.\n{PROBE}")
    assert displaced(package) == (pytest.approx(5.17), False), "prose compiles nothing"
    (kept,) = package.rglob("*.nbc")
    signals = package / "loop" / "signals.py"
    # The helper is made by ``helper(displacement)``: no decorator stands in that file.
    signals.write_text(signals.read_text().replace("kx * ky - kxy * kxy", "2.0 * (kx * ky - kxy * kxy)"))
    assert displaced(package) == (pytest.approx(2.585), True)
    (newer,) = package.rglob("*.nbc")
    assert newer != kept, "the old code is gone"
    content = bytearray(newer.read_bytes())
    content[len(content) // 2] ^= 1
    newer.write_bytes(content)
    assert displaced(package) == (pytest.approx(2.585), True), "damaged code is compiled anew"
    assert displaced(package) == (pytest.approx(2.585), False)
    newer.unlink()
    assert displaced(package, largest_file=1000) == (pytest.approx(2.585), True), "a full disk keeps nothing"
    assert not [path for path in newer.parent.iterdir() if path.suffix not in (".pyc", ".code")]


def test_the_stamp_is_of_all_that_a_kernel_imports():
    def imported(name):
        return {path.stem for path in dependencies([(ROOT / "birthsim_env" / name).resolve()])}

    assert {"dynamics", "chambers", "friction", "geometry", "mechanics", "valves", "lanes"} <= imported("physics/dynamics.py")
    assert "signals" in imported("reward.py"), "compliance is made there"
    assert "geometry" in imported("../birthsim_live/rig/stages.py")
    assert "references" not in imported("physics/dynamics.py"), "an edit there need not compile the plant anew"
    stamps = {source_stamp(ROOT / "birthsim_env" / name) for name in ("physics/dynamics.py", "reward.py")}
    assert len(stamps) == 2


def test_the_stamp_knows_no_folder(tmp_path):
    """In the order of whole paths, what these import stands before the first and behind the second."""
    generated, own = f"{tmp_path.name}.source", "own.py"
    places = {generated: [ROOT / "out", ROOT / "birthsim_env" / "__pycache__"], own: [tmp_path / "a", tmp_path / "b"]}
    for name, folders in places.items():
        stamps = set()
        for folder in folders:
            folder.mkdir(exist_ok=True)
            (folder / name).write_text(PROBE)
            try:
                stamps.add(source_stamp(folder / name))
            finally:
                (folder / name).unlink()
        assert len(stamps) == 1, name


ODD = """
'import birthsim_env.observation'
import birthsim_env.reward, numpy as np; from birthsim_env import info
if True: import birthsim_env.scores as s
def f():
    from birthsim_env.physics.compiled import ( # exact )
        lanes as l,  # )
        exact,
    )
    from birthsim_env.loop import \\
        rows
"""


def test_imports_stand_anywhere(tmp_path):
    odd = tmp_path / "odd.py"
    odd.write_text(ODD)
    assert {path.relative_to(ROOT).as_posix() for path in imports(odd)} == {
        *(f"birthsim_env/{name}.py" for name in ("reward", "info", "scores", "loop/rows")),
        *(f"birthsim_env/physics/compiled/{name}.py" for name in ("lanes", "exact")),
    }


CODE = """
from __future__ import annotations
import birthsim_env

@kernel
def f(x: int, y=(1, 2)) -> float:
    \"\"\"What it does.\"\"\"
    a = x + 1.0  # a comment
    return {"k": a, **y}
"""


@pytest.mark.parametrize(
    ("then", "now", "same"),
    [
        ("What it does.", "What it did, with 'baselines.named'.", True),
        ("  # a comment", "", True),
        ("from __future__ import annotations\n", "", True),
        ("x + 1.0", "(\n        x\n        + 1.0\n    )", True),
        ("1.0", "1.1", False),
        ("1.0", "1", False),
        ("@kernel\n", "", False),
        ("@kernel", "@helper", False),
        ("x: int", "x: float", False),
        ("(1, 2)", "(2, 1)", False),
        ("(1, 2)", "[1, 2]", False),
        ("**y", "'y': y", False),
        ("a = x", "a = -x", False),
        ("import birthsim_env", "import birthsim_env as other", False),
    ],
)
def test_code_counts_and_prose_does_not(tmp_path, monkeypatch, then, now, same):
    monkeypatch.setattr(sources, "cache_folder", lambda: tmp_path)
    before, after = tmp_path / "before.py", tmp_path / "after.py"
    before.write_text(CODE)
    after.write_text(CODE.replace(then, now))
    assert after.read_text() != CODE
    assert (source(before) == source(after)) == same
    assert len(list(tmp_path.glob("*.code"))) == 2
    assert source.__wrapped__(after) == source(after), "what is kept says the same"
    monkeypatch.setattr(sources, "cache_folder", lambda: None)
    assert source.__wrapped__(after) == source(after)


def test_without_a_writable_folder_or_a_home_there_is_no_cache(monkeypatch, tmp_path):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "folder"))
    monkeypatch.setattr(kept_on_disk, "PACKAGE", tmp_path / "file")
    assert kept_on_disk.cache_folder.__wrapped__() is None
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "own"))
    assert kept_on_disk.cache_folder.__wrapped__() == tmp_path / "own"
