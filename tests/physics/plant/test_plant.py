"""``Plant`` as an interface: shapes, samples of the force, steps, the start, vectorised kernel."""

import math
import os
import platform
import re
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, STATE_NAMES, Y1, Y2
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.runge_kutta import STAGES
from tests.console import ROOT


def test_shapes_and_names_of_what_the_plant_shows() -> None:
    plant = Plant(num_envs=3)
    assert plant.state.shape == (18, 3) == (len(STATE_NAMES), 3)
    assert plant.lane_parameters.shape == (len(PARAMETER_NAMES), 3)
    computed = plant.end_effector(), plant.mass_flows(), plant.impacts
    assert [array.shape for array in computed] == [(4, 3), (8, 3), (2, 3)]
    plant.state[:] = np.arange(18)[:, None]
    rows = {name: float(row) for row, name in enumerate(STATE_NAMES)}
    views = plant.piston, plant.piston_speed, plant.pressures, plant.temperatures
    for array, names in zip(views, ("y1 y2", "v1 v2", "Pp1 Pn1 Pp2 Pn2", "Tp1 Tn1 Tp2 Tn2"), strict=True):
        assert array.tolist() == [[rows[name]] * 3 for name in names.split()]


def test_a_plant_starts_at_mid_stroke_at_rest_and_advances_in_place() -> None:
    plant = Plant()
    assert not plant.piston.any()
    assert not plant.piston_speed.any()
    assert plant.end_effector()[:, 0] == pytest.approx([0.5, 0.0, 0.0, 0.0], abs=0.02)
    assert np.all(plant.temperatures == 293.15)
    state = plant.state
    assert plant.advance(np.full((4, 1), 0.3), np.zeros((2, 1)), 0.01) is state is plant.state


def test_force_samples_are_successive_calls() -> None:
    rng = np.random.default_rng(1)
    command, forces = rng.uniform(-1, 1, (4, 5)), rng.uniform(-150, 150, (8, 2, 5))
    together, apart = Plant(num_envs=5), Plant(num_envs=5)
    for plant in (together, apart):
        plant.state[Y2], plant.state[Y1] = 0.19, 0.09
    together.advance(command, forces, 0.08)
    impacts = []
    for force in forces:
        apart.advance(command, force, 0.01)
        impacts.append(apart.impacts.copy())
    np.testing.assert_array_equal(together.state, apart.state)
    np.testing.assert_array_equal(together.impacts, np.max(impacts, axis=0))
    assert together.impacts.max() > 0.01, "some piston must have met its stop"


def test_steps_are_never_longer_than_the_default_and_fill_the_duration() -> None:
    """0.9 of four steps is four of 0.9: the spool, alone in its equation, shows both the time passed and the step."""
    plant = Plant()
    plant.advance(np.ones((4, 1)), np.zeros((2, 1)), 3.6 * dynamics.INTEGRATION_STEP)
    h = 0.9 * dynamics.INTEGRATION_STEP / 0.004
    left = sum((-h) ** k / math.factorial(k) for k in range(STAGES + 1))
    assert plant.state[14, 0] == pytest.approx(1 - left**4, rel=1e-13)


DISASSEMBLE = """
import numba
from birthsim_env.loop import stage, world
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.with_numba import block_type
number, array, samples = numba.float64, numba.float64[:, ::1], numba.float64[:, :, ::1]
kernel, kinds = {
    "rates": (dynamics.derivatives, [array] * 5),
    "plant": (dynamics.advance, [array, array, samples, array, numba.int64, number, array]),
    "stage": (world._plant, [block_type(own) if own else numba.int64 for own in stage.layouts_of(world._plant)]),
}[KERNEL]
compiled = numba.njit(error_model="numpy", nogil=True)(kernel.py_func)  # one from the cache shows no assembly
compiled.compile(tuple(kinds))
print(*compiled.inspect_asm().values())
"""


def divisions_and_roots(kernel: str, block: int) -> Counter[str]:
    """Instructions in the machine code of a kernel for AVX2, packed and scalar."""
    target = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+sse,+sse2,+sse4.1,+sse4.2,+avx,+avx2"}
    line = [sys.executable, "-c", DISASSEMBLE.replace("KERNEL", repr(kernel))]
    own = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment = {**own, **target, "BIRTHSIM_BLOCK": str(block), "BIRTHSIM_DEBUG": "0"}
    done = subprocess.run(line, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    return Counter(re.findall(r"^\s+v?(divpd|divsd|sqrtpd|sqrtsd)\b", done.stdout, re.MULTILINE))


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instruction names")
@pytest.mark.parametrize(("kernel", "sides"), [("rates", 1), ("plant", 2), ("stage", 2)])
def test_kernel_is_vectorised(kernel: str, sides: int) -> None:
    """Each division and root of each right-hand side stands there packed: 10 and 9."""
    found = divisions_and_roots(kernel, 32)
    assert found["divpd"] >= 10 * sides, found
    assert found["sqrtpd"] >= 9 * sides, found


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instruction names")
@pytest.mark.parametrize("kernel", ["plant", "stage"])
def test_four_chambers_of_a_lane_alone_share_a_vector(kernel: str) -> None:
    """Code for one lane: 4 of 10 divisions and 8 of 9 roots in each of two right-hand sides stand in vectors of four."""
    found = divisions_and_roots(kernel, 1)
    assert (found["divpd"], found["sqrtpd"]) == (2, 4), found
    assert found["divsd"] < 2 * 10, found
    assert found["sqrtsd"] < 2 * 9, found
