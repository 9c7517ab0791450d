"""A controller in C that is told another rig while it runs."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from baselines.named import make_controller
from birthsim_build.building import build_c, build_cortex
from birthsim_build.bundle import make_bundle
from birthsim_build.code.targets import HOST
from birthsim_build.code.tools import run_tool
from birthsim_build.faces.beliefs import belief_in, beliefs
from birthsim_env import Measurement, Parameters, Reference
from lab.studies.targets.running import EMULATED
from tests.build.targets import assert_same_bits, need, need_linker, need_program
from tests.console import ROOT

BELIEVES, NAME = "admittance[own_beliefs=true]", "law_admittance_own_beliefs_true__sampled"
PROGRAM, DEFINED = ROOT / "tests/build/believe.c", f"-DBELIEF=BIRTHSIM_{NAME.upper()}_BELIEF"
TOLD = {"mechanics.mass": 4.5, "valves.time_constant": 0.004, "cylinder1.coulomb_friction": 17.0}
"""What believe.c tells in period 100."""


def _commanded(told):
    """Openings (300, 4) of Python's controller for the signals of believe.c."""
    law, reference, found = make_controller(BELIEVES, Parameters()), Reference(np.zeros(15)), np.empty((300, 4))
    reference.position[0], reference.stiffness[:], reference.pneumatic_stiffness[:] = 0.5, 2000.0, (4600.0, 2300.0)
    for k, openings in enumerate(found):
        if told and k == 100:
            law.believe(Parameters().replace(TOLD))
        now, at = np.array(k * 0.001), np.array([0.5 + k / 65536, 0.0])
        pressures, speed, force = np.array([4e5, 4.5e5, 4e5, 4.5e5]), np.array([1 / 64, 0.0]), np.array([2.0, 0.0])
        openings[:] = law.command(Measurement(now, at, now, speed, pressures, force, True), reference)
    return found


def _printed(*line):
    """Openings (T, 4) that a program prints."""
    said = subprocess.run([str(word) for word in line], check=True, capture_output=True, text=True).stdout
    return np.array([one.split() for one in said.splitlines()], dtype=float)


def test_a_controller_in_c_goes_over_to_a_rig_as_python_does(tmp_path):
    need_linker()
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    need(shutil.which("cc"), "a C compiler is missing")
    build_c(make_bundle(Parameters(), [], ["lab"], [BELIEVES], alone=True), HOST, tmp_path)
    strict = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", DEFINED)
    where = (f"-I{tmp_path}", f"-L{tmp_path}", f"-Wl,-rpath,{tmp_path}")
    program = tmp_path / "believe"
    subprocess.run(["cc", *strict, PROGRAM, *where, "-lbirthsim", "-lm", "-o", program], check=True)
    found, told, untold = _printed(program), _commanded(True), _commanded(False)
    assert_same_bits(found, told)
    np.testing.assert_array_equal(told[:100], untold[:100])
    # What was told is seen.
    assert np.abs(told[-1] - untold[-1]).max() > 1e-3


@pytest.mark.slow
@pytest.mark.weekly
def test_a_microcontroller_goes_over_to_a_rig_with_the_same_bits(tmp_path):
    need_linker()
    system, emulator = EMULATED["cortex-m7"]
    need_program(emulator, "qemu-user")
    build_cortex(make_bundle(Parameters(), [], ["lab"], [BELIEVES], alone=True), tmp_path)
    program = tmp_path / "believe"
    line = ("-m", "ziglang", "cc", "-target", system, "-static", "-O1", "-I", tmp_path, DEFINED)
    run_tool(sys.executable, *map(str, (*line, PROGRAM, tmp_path / "birthsim.o", "-o", program))).check_returncode()
    assert_same_bits(_printed(emulator, program), _commanded(True))


@pytest.mark.parametrize("controller", ["admittance-adaptive", "admittance[finds_rig=true]", "pid"])
def test_controllers_that_are_told_nothing_have_no_belief_in_c(controller):
    bundle = make_bundle(Parameters(), [], ["lab"], [controller], alone=True)
    images = bundle.images()
    assert [belief_in(words, bundle.functions) for words in images.values()] == [None]
    assert beliefs(bundle, images) == ""
