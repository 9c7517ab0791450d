"""``Plant`` as an interface: shapes, refusals, equality of lanes and samples, balance at the start, vectorised kernel."""

import math
import os
import platform
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, STATE_NAMES, Y1, Y2, Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

ROOT = Path(__file__).parents[3]
RANDOMIZED = {
    "mechanics.mass": (2, 5),
    "cylinder1.coulomb_friction": (6, 25),
    "cylinder2.viscous_friction": (10, 60),
    "chambers.dead_volume": (5e-6, 25e-6),
    "valves.time_constant": (0.0015, 0.008),
}


def varied_rigs(lanes: int, rng: np.random.Generator) -> list[Parameters]:
    draws = {name: rng.uniform(*limits, lanes) for name, limits in RANDOMIZED.items()}
    laws = ["lugre", "coulomb", "elasto_plastic"]
    changes = ({**{k: float(v[i]) for k, v in draws.items()}, "friction.law": laws[i % 3]} for i in range(lanes))
    return [Parameters().replace(change) for change in changes]


def idle(lanes: int) -> tuple[Array, Array]:
    return np.zeros((4, lanes)), np.zeros((2, lanes))


def test_shapes_names_and_units_of_what_the_plant_shows() -> None:
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
    assert plant.derivatives(Plant(num_envs=3).state, *idle(3)).shape == (18, 3)


def test_advance_changes_the_state_in_place_and_returns_it() -> None:
    plant = Plant(num_envs=2)
    state, before = plant.state, plant.state.copy()
    assert plant.advance(np.full((4, 2), 0.3), np.zeros((2, 2)), 0.01) is state is plant.state
    assert np.abs(state - before).max() > 0.1
    np.testing.assert_array_equal(state[:, 0], state[:, 1])


def test_state_starts_at_mid_stroke_at_rest() -> None:
    plant = Plant()
    assert not plant.piston.any()
    assert not plant.piston_speed.any()
    x, y, vx, vy = plant.end_effector()[:, 0]
    assert (x, y) == pytest.approx((0.5, 0.0), abs=0.02)
    assert vx == vy == 0
    assert np.all(plant.temperatures == 293.15)


OK, NONE = np.zeros((4, 2)), np.zeros((2, 2))
REFUSALS: dict[str, tuple[Any, Any, Any, str]] = {
    "opening beyond 1": (OK + 1.5, NONE, 0.01, r"opening_command reaches 1\.5; allowed: -1 to 1"),
    "opening nan": (OK * math.nan, NONE, 0.01, r"opening_command\[0, 0\] = nan; allowed: finite"),
    "opening shape": (np.zeros(4), NONE, 0.01, r"opening_command has shape \(4,\); allowed: \(4, 2\)"),
    "opening text": ("wide", NONE, 0.01, r"opening_command = 'wide'; allowed: numbers"),
    "force infinite": (OK, NONE + math.inf, 0.01, r"user_force\[0, 0\] = inf; allowed: finite numbers \(N\)"),
    "force shape": (OK, [1.0, 2.0], 0.01, r"user_force has shape \(2,\); allowed: \(2, 2\) \(N\)"),
    "force scalar": (OK, 5.0, 0.01, r"user_force has shape .*; allowed: \(2, 2\)"),
    "force samples of other lanes": (OK, np.zeros((5, 2, 3)), 0.01, r"user_force has shape \(5, 2, 3\); allowed: \(5, 2, 2\)"),
    "force of no samples": (OK, np.zeros((0, 2, 2)), 0.01, r"user_force has shape \(0, 2, 2\); allowed: \(2, 2\)"),
    "force of four axes": (OK, np.zeros((2, 3, 2, 2)), 0.01, r"user_force has shape \(2, 3, 2, 2\); allowed: \(2, 2\)"),
    "force ragged": (OK, [[1, 2], [3]], 0.01, r"user_force = \[\[1, 2\], \[3\]\]; allowed: numbers of shape \(2, 2\)"),
    "duration nan": (OK, NONE, math.nan, r"duration = nan; allowed: a positive number, at most 3600 \(s\)"),
    "duration zero": (OK, NONE, 0, r"duration = 0; allowed: a positive number"),
    "duration negative": (OK, NONE, -0.01, r"duration = -0\.01; allowed: a positive number"),
    "duration text": (OK, NONE, "long", r"duration = 'long'; allowed: a positive number"),
}


@pytest.mark.parametrize(("command", "force", "duration", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_advance_refuses_by_name_and_leaves_the_state(command: Any, force: Any, duration: Any, message: str) -> None:
    plant = Plant(num_envs=2)
    before = plant.state.copy()
    with pytest.raises(ValueError, match=message):
        plant.advance(command, force, duration)
    np.testing.assert_array_equal(plant.state, before)


def test_a_lane_of_a_thousand_is_the_plant_alone_bit_for_bit() -> None:
    lanes, rng = 1000, np.random.default_rng(0)
    rigs = varied_rigs(lanes, rng)
    crowd = Plant(rigs, lanes)
    commands, forces = rng.uniform(-1, 1, (20, 4, lanes)), rng.uniform(-100, 100, (20, 2, lanes))
    hit = np.zeros((2, lanes))
    for command, force in zip(commands, forces, strict=True):
        crowd.advance(command, force, 0.01)
        hit = np.maximum(hit, crowd.impacts)
    # The first and last lane of blocks of 32 and of the incomplete one, and some others.
    for i in (0, 1, 30, 31, 32, 63, 500, 511, 512, 990, 991, 992, 993, 998, 999, *rng.integers(0, lanes, 60)):
        alone, alone_hit = Plant(rigs[i]), np.zeros((2, 1))
        for command, force in zip(commands, forces, strict=True):
            alone.advance(command[:, [i]], force[:, [i]], 0.01)
            alone_hit = np.maximum(alone_hit, alone.impacts)
        np.testing.assert_array_equal(alone.state[:, 0], crowd.state[:, i])
        np.testing.assert_array_equal(alone.end_effector()[:, 0], crowd.end_effector()[:, i])
        np.testing.assert_array_equal(alone_hit[:, 0], hit[:, i])
    assert np.ptp(crowd.piston, axis=1).min() > 0.05, "the lanes must differ"


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
    """0.9 ms is four steps of 0.225 ms: the spool, alone in its equation, shows both the time passed and the step."""
    plant = Plant()
    plant.advance(np.ones((4, 1)), np.zeros((2, 1)), 0.9e-3)
    h = 0.225e-3 / 0.004
    assert plant.state[14, 0] == pytest.approx(1 - (1 - h + h**2 / 2 - h**3 / 6 + h**4 / 24) ** 4, rel=1e-13)


def test_nothing_moves_at_balance() -> None:
    lanes, rng = 200, np.random.default_rng(2)
    rigs = [rig.replace({"valves.leakage_ratio": 0.0}) for rig in varied_rigs(lanes, rng)]
    plant = Plant(rigs, lanes)
    piston = rng.uniform(-0.95, 0.95, (2, lanes)) * [[0.1], [0.2]]
    plant.state[:] = balanced_state(plant.lane_parameters, piston, pneumatic_stiffness=rng.uniform(500, 9000, (2, lanes)))
    assert np.abs(plant.derivatives(plant.state, *idle(lanes))[:4]).max() < 1e-11
    start = plant.state.copy()
    plant.advance(*idle(lanes), 1.0)
    np.testing.assert_allclose(plant.piston, piston, rtol=0, atol=1e-12)
    np.testing.assert_allclose(plant.state, start, rtol=1e-9, atol=1e-11)


DISASSEMBLE = """
import numba, numpy as np
from birthsim_env.physics import dynamics
kernel = numba.njit(error_model="numpy", nogil=True)(dynamics.derivatives.py_func)  # one from the cache shows no assembly
kernel.compile((numba.typeof(np.zeros((1, 1))),) * 5)
print(*kernel.inspect_asm().values())
"""


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instruction names")
def test_kernel_is_vectorised() -> None:
    """Each division and root stands there twice, packed and for leftover lanes; scalar code would have no packed ones.

    The right-hand side is compiled for AVX2, and not run, whatever this processor can do."""
    target = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+sse,+sse2,+sse4.1,+sse4.2,+avx,+avx2"}
    line = [sys.executable, "-c", DISASSEMBLE]
    done = subprocess.run(line, cwd=ROOT, env={**os.environ, **target}, capture_output=True, text=True, check=True)
    found = Counter(re.findall(r"^\s+v?(divpd|divsd|sqrtpd|sqrtsd)\b", done.stdout, re.MULTILINE))
    for operation, least in (("div", 10), ("sqrt", 9)):
        packed, scalar = found[operation + "pd"], found[operation + "sd"]
        assert packed >= max(least, 0.75 * scalar), found
