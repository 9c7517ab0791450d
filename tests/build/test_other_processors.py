"""The code for other processors computes the bits of Python, under qemu."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from baselines.registry import make_controller
from birthsim_build.layout import ROWS
from birthsim_env import Parameters
from birthsim_env.loop.rows import ASKED, WORLD
from birthsim_env.loop.signals import Measurement, Reference
from tests.build.targets import BUILT, PERIODS, ROW, SHARED, assert_same_bits, build, loop_name, need, need_linker, python_rows

TRACE = Path(__file__).parent / "trace.c"
ZIG = {"aarch64": "aarch64-linux-musl", "cortex-m7": "arm-linux-musleabihf"}
QEMU = {"aarch64": "qemu-aarch64", "cortex-m7": "qemu-arm"}

pytestmark = pytest.mark.slow


def _traced(target, folder, loop, given=None):
    """All rows (PERIODS, ROWS) of a loop; ``given`` (PERIODS, ASKED) are what it sees."""
    need_linker()
    need(shutil.which(QEMU[target]), f"{QEMU[target]} is missing: apt-get install qemu-user")
    about = (f"-DLOOP=birthsim_{loop}", f"-DPERIODS={PERIODS}", f"-DFIRST={WORLD}", f"-DCOUNT={0 if given is None else ASKED}")
    line = [sys.executable, "-m", "ziglang", "cc", "-target", ZIG[target], "-static", "-O1", *about, "-I", folder, TRACE]
    subprocess.run([*map(str, line), str(folder / "birthsim.o"), "-o", str(folder / loop)], check=True)
    content = b"" if given is None else np.ascontiguousarray(given).tobytes()
    done = subprocess.run([QEMU[target], str(folder / loop)], input=content, check=True, capture_output=True)
    return np.frombuffer(done.stdout).reshape(PERIODS, ROWS)


@pytest.fixture(scope="module")
def aarch64(tmp_path_factory):
    need_linker()
    folder = tmp_path_factory.mktemp("aarch64")
    build("aarch64", folder, *BUILT)
    return folder


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("controller", ["admittance-backstepping", "residual:circle"])
def test_closed_loops_on_aarch64(aarch64, sensors, controller):
    rows = _traced("aarch64", aarch64, loop_name("circle", sensors, controller))
    assert_same_bits(rows[:, SHARED], python_rows("circle", sensors, controller)[:, SHARED])


@pytest.mark.parametrize(("sensors", "kind"), [("ideal", "exact"), ("lab", "sampled")])
def test_a_law_on_cortex_m7(tmp_path, sensors, kind):
    need_linker()
    build("cortex-m7", tmp_path, "--controller", "admittance-backstepping", "--sensors", sensors)
    seen = python_rows("circle", sensors, "admittance-backstepping")[:, WORLD : WORLD + ASKED]
    law, openings = make_controller("admittance-backstepping", Parameters()), np.empty((PERIODS, 4))
    for opened, now in zip(openings, seen, strict=True):
        rows = now[:, None]
        said = Measurement(rows[0], rows[1:3], rows[5], rows[3:5], rows[6:10], rows[10:12], sensors == "lab")
        opened[:] = law.command(said, Reference(rows[12:27]))[:, 0]
    rows = _traced("cortex-m7", tmp_path, f"law_admittance_backstepping_{kind}", seen)
    assert_same_bits(rows[:, ROW["opening_P1"] : ROW["opening_P1"] + 4], openings)
