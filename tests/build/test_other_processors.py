"""The code for other processors computes the bits of Python, under qemu."""

import pytest

from birthsim_build.bundle import identifier
from birthsim_build.code.targets import HOST
from studies.targets.reference import PERIODS, SHARED, law_openings, loop_rows
from studies.targets.running import EMULATED, ROW, emulated_rows
from tests.build.targets import BUILT, assert_same_bits, build, need_linker, need_program

pytestmark = pytest.mark.slow


def _need(target):
    if HOST is None:
        pytest.skip("qemu runs programs of Linux")
    need_linker()
    need_program(EMULATED[target][1], "qemu-user")


@pytest.fixture(scope="module")
def aarch64(tmp_path_factory):
    _need("aarch64")
    folder = tmp_path_factory.mktemp("aarch64")
    build("aarch64", folder, *BUILT)
    return folder


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("controller", ["admittance-backstepping", "residual:circle", "residual:circle_honest_student"])
def test_closed_loops_on_aarch64(aarch64, sensors, controller):
    rows = emulated_rows("aarch64", aarch64, f"circle_{sensors}_{identifier(controller)}", PERIODS)
    assert_same_bits(rows[:, SHARED], loop_rows("circle", sensors, controller)[:, SHARED])


@pytest.mark.parametrize(("sensors", "kind"), [("ideal", "exact"), ("lab", "sampled")])
def test_a_law_on_cortex_m7(tmp_path, sensors, kind):
    _need("cortex-m7")
    build("cortex-m7", tmp_path, "--controller", "admittance-backstepping", "--sensors", sensors)
    seen, openings = law_openings("admittance-backstepping", sensors)
    rows = emulated_rows("cortex-m7", tmp_path, f"law_admittance_backstepping_{kind}", PERIODS, seen)
    assert_same_bits(rows[:, ROW["opening_P1"] : ROW["opening_P1"] + 4], openings)
