"""Compiled code is never stale, and no cache file, disk or home directory is needed to compile."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from birthsim_env.physics.compiled import compilation
from birthsim_env.physics.compiled.sources import PACKAGES, dependencies, file_of, imports, source_stamp

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
    folder.mkdir()
    for name in (
        "files",
        "loop/signals",
        *(f"physics/{part}" for part in ("electronics", "valves")),
        *(
            f"physics/compiled/{part}"
            for part in ("compilation", "lanes", "exact", "records", "record_types", "resolution", "sources")
        ),
        *(f"physics/rig/{part}" for part in ("parameters", "quantities", "reading", "sections", "values")),
    ):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "birthsim_env" / f"{name}.py", (folder / name).parent)
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
    assert not [path for path in newer.parent.iterdir() if path.suffix != ".pyc"]


def test_the_stamp_is_of_all_that_a_kernel_imports():
    def imported(name):
        return {path.stem for path in dependencies([(ROOT / "birthsim_env" / name).resolve()])}

    assert {"dynamics", "chambers", "friction", "geometry", "mechanics", "valves", "lanes"} <= imported("physics/dynamics.py")
    assert "signals" in imported("reward.py"), "compliance is made there"
    assert "inverse_kinematics" in imported("../birthsim_live/rig/stages.py")
    assert "references" not in imported("physics/dynamics.py"), "an edit there need not compile the plant anew"
    stamps = {source_stamp(ROOT / "birthsim_env" / name) for name in ("physics/dynamics.py", "reward.py")}
    assert len(stamps) == 2


ODD = """
import birthsim_env.reward, numpy as np; from birthsim_env import info
if True: import birthsim_env.success as s
def f():
    from birthsim_env.physics.compiled import ( # exact )
        lanes as l,  # )
        exact,
    )
    from birthsim_env.loop import \\
        rows
"""


def test_no_import_that_the_syntax_tree_has_is_overlooked(tmp_path):
    """Nor any of the project's; a line of a docstring that reads like an import does no harm."""

    def of_tree(path):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                yield from (file_of(alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    yield file_of(f"{node.module}.{alias.name}") or file_of(node.module)

    odd = tmp_path / "odd.py"
    odd.write_text(ODD)
    for path in [odd, *(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))]:
        assert set(filter(None, of_tree(path))) <= imports(path), path
    stems = {path.parent.name if path.stem == "__init__" else path.stem for path in imports(odd)}
    assert stems == {"reward", "info", "success", "lanes", "exact", "rows"}


def test_without_a_writable_folder_or_a_home_there_is_no_cache(monkeypatch, tmp_path):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "folder"))
    monkeypatch.setattr(compilation, "ROOT", tmp_path / "file")
    assert compilation.cache_folder.__wrapped__() is None
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "own"))
    assert compilation.cache_folder.__wrapped__() == tmp_path / "own"
