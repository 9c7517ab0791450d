"""The C header and the example."""

import os
import shutil
import subprocess

import numpy as np

from lab.studies.targets.running import ROW, library_rows
from tests.build.targets import need

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")


def _run(*line, **options):
    return subprocess.run([str(word) for word in line], check=True, capture_output=True, text=True, **options).stdout


def _assert_right(program, library):
    """What the example prints is what the library computes in Python."""
    said = np.array([[float(word) for word in line.split()] for line in _run(program).splitlines()[1:]])
    rows = library_rows(library, "circle_ideal_admittance_backstepping", 2000)[99::100]
    assert (said == rows[:, [ROW["time"], ROW["x"], ROW["y"]]]).all()


def test_the_example_builds_with_cmake(library, tmp_path):
    need(shutil.which("cmake") and shutil.which("cc"), "cmake or a C compiler is missing")
    _run("cmake", "-S", library, "-B", tmp_path)
    _run("cmake", "--build", tmp_path)
    _assert_right(tmp_path / "example", library)


def test_the_example_is_strict_c99_and_builds_with_pkg_config(library, tmp_path):
    need(shutil.which("pkg-config") and shutil.which("cc"), "pkg-config or a C compiler is missing")
    flags = _run("pkg-config", "--cflags", "--libs", "birthsim", env={**os.environ, "PKG_CONFIG_PATH": str(library)}).split()
    _run("cc", *STRICT, library / "example.c", *flags, f"-Wl,-rpath,{library}", "-o", tmp_path / "example")
    _assert_right(tmp_path / "example", library)
