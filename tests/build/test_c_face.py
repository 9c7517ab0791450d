"""The C header and the examples."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from baselines.named import make_controller
from birthsim_build.code.tools import run_tool
from birthsim_build.faces.c import write_examples, write_header
from birthsim_env import Measurement, Parameters, Reference
from lab.studies.targets.running import EMULATED, ROW, library_rows
from tests.build.targets import assert_same_bits, need, need_linker, need_program

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")


def _run(*line, **options):
    return subprocess.run([str(word) for word in line], check=True, capture_output=True, text=True, **options).stdout


def _printed(*line):
    return np.array([[float(word) for word in one.split()] for one in _run(*line).splitlines()[1:]])


def _assert_right(program, library):
    """What the example prints is what the library computes in Python."""
    rows = library_rows(library, "circle_ideal_admittance_backstepping", 2000)[99::100]
    assert (_printed(program) == rows[:, [ROW["time"], ROW["x"], ROW["y"]]]).all()


def _commanded():
    """What Python's controller says to the signals of controller.c."""
    law, reference, found = (
        make_controller("admittance-backstepping", Parameters()),
        Reference(np.zeros(15)),
        np.empty((200, 7)),
    )
    reference.position[0], reference.stiffness[:], reference.pneumatic_stiffness[:] = 0.5, 2000.0, (4600.0, 2300.0)
    found, speed, force = np.empty((200, 7)), np.array([1 / 64, 0.0]), np.array([2.0, 0.0])
    for k, own in enumerate(found):
        pressures = np.array([4e5, np.nan if 100 <= k < 105 else 4.5e5, 4e5, 4.5e5])
        time, at, speed, force = (
            np.array(k * 0.001),
            np.array([0.5 + k / 65536, 0.0]),
            np.array([1 / 64, 0.0]),
            np.array([2.0, 0.0]),
        )
        openings = law.command(Measurement(time, at, time, speed, pressures, force, False), reference)
        own[:] = time, *openings, law.missed[0], 2.0 * law.ended[0]
    assert np.ptp(found[:, 1:5], axis=0).min() > 1e-3
    assert found[-1, 5:].tolist() == [5.0, 0.0]
    return found


def test_the_examples_build_with_cmake(library, tmp_path):
    need(shutil.which("cmake") and shutil.which("cc"), "cmake or a C compiler is missing")
    _run("cmake", "-S", library, "-B", tmp_path)
    _run("cmake", "--build", tmp_path)
    _assert_right(tmp_path / "example", library)
    assert_same_bits(_printed(tmp_path / "controller"), _commanded())


def test_the_examples_are_strict_c99_and_build_with_pkg_config(library, tmp_path):
    need(shutil.which("pkg-config") and shutil.which("cc"), "pkg-config or a C compiler is missing")
    flags = _run("pkg-config", "--cflags", "--libs", "birthsim", env={**os.environ, "PKG_CONFIG_PATH": str(library)}).split()
    for name in ("example", "controller"):
        _run("cc", *STRICT, library / f"{name}.c", *flags, f"-Wl,-rpath,{library}", "-o", tmp_path / name)
    _assert_right(tmp_path / "example", library)


def test_the_header_of_controllers_alone_names_nothing_else(tmp_path):
    """As a microcontroller gets it; its example compiles with it."""
    need(shutil.which("cc"), "a C compiler is missing")
    images = {"law_pid_exact": np.zeros(700, dtype=np.int64)}
    write_header(images, 0.002, tmp_path)
    write_examples(images, tmp_path, linked=False)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["birthsim.h", "controller.c"]
    _run("cc", *STRICT, "-fsyntax-only", tmp_path / "controller.c")
    header = (tmp_path / "birthsim.h").read_text()
    assert "#define BIRTHSIM_PERIOD 0.002\n" in header
    assert "birthsim_begin(law, birthsim_law_pid_exact, BIRTHSIM_LAW_PID_EXACT_WORDS);" in header
    assert "closed loop" not in header
    assert "birthsim_plant" not in header.lower()


@pytest.mark.slow
@pytest.mark.weekly
def test_the_example_of_a_controller_alone_on_cortex_m7(cortex, tmp_path):
    need_linker()
    system, emulator = EMULATED["cortex-m7"]
    need_program(emulator, "qemu-user")
    line = (
        "-m",
        "ziglang",
        "cc",
        "-target",
        system,
        "-static",
        "-O1",
        "-I",
        cortex,
        cortex / "controller.c",
        cortex / "birthsim.o",
    )
    run_tool(sys.executable, *map(str, line), "-o", str(tmp_path / "controller")).check_returncode()
    assert_same_bits(_printed(emulator, tmp_path / "controller"), _commanded())
