"""What is built computes the bits of Python: closed loops, laws alone and the plant alone."""

from functools import cache

import numpy as np
import pytest

from baselines.registry import make_controller
from birthsim_env import Parameters, Plant
from birthsim_env.loop.rows import ASKED, WORLD
from birthsim_env.loop.signals import Measurement, Reference
from tests.build.targets import PERIODS, ROW, SHARED, STEPS, assert_same_bits, library_rows, loop_name, node_rows, python_rows

CASES = [
    ("ideal", "admittance-backstepping"),
    ("lab", "admittance-backstepping"),
    ("ideal", "residual:circle"),
    ("lab", "residual:circle"),
]
CHAMBERS = ("P1", "N1", "P2", "N2")
recorded = cache(python_rows)


@pytest.mark.parametrize(("sensors", "controller"), CASES)
def test_a_closed_loop_in_webassembly(wasm, tmp_path, sensors, controller):
    rows = node_rows(wasm, ["loop", {"scenario": "circle", "sensors": sensors, "controller": controller}], tmp_path)
    assert_same_bits(rows[:, SHARED], recorded("circle", sensors, controller)[:, SHARED])


@pytest.mark.parametrize(("sensors", "controller"), CASES)
def test_a_closed_loop_in_c(library, sizes, sensors, controller):
    name = loop_name("circle", sensors, controller)
    rows = library_rows(library, name, sizes[name] // 8)
    assert_same_bits(rows[:, SHARED], recorded("circle", sensors, controller)[:, SHARED])


@pytest.fixture(scope="module")
def pushed():
    """The plant in Python under random openings and forces, each for a policy step: inputs and states (PERIODS, 18)."""
    rng = np.random.default_rng(0)
    openings, forces = rng.uniform(-0.3, 0.3, (STEPS, 4)), rng.uniform(-30, 30, (STEPS, 2))
    openings, forces = (np.repeat(one, PERIODS // STEPS, axis=0) for one in (openings, forces))
    plant, states = Plant(), np.empty((PERIODS, 18))
    for state, opening, force in zip(states, openings, forces, strict=True):
        state[:] = plant.advance(opening[:, None], force[:, None], 0.001)[:, 0]
    inputs = {f"opening_{name}": openings[:, k] for k, name in enumerate(CHAMBERS)}
    return {**inputs, "force_x": forces[:, 0], "force_y": forces[:, 1]}, states


def test_the_plant_alone(wasm, library, sizes, tmp_path, pushed):
    inputs, states = pushed
    mine = slice(ROW["y1"], ROW["y1"] + 18)
    assert_same_bits(node_rows(wasm, ["plant"], tmp_path, inputs=inputs)[:, mine], states)
    assert_same_bits(library_rows(library, "plant", sizes["plant"] // 8, inputs=inputs)[:, mine], states)


@pytest.mark.parametrize(("sensors", "kind"), [("ideal", "exact"), ("lab", "sampled")])
def test_a_law_alone(wasm, library, sizes, tmp_path, sensors, kind):
    """It gets what the sensors say in a recorded loop, and opens valves as the law in Python does."""
    seen = recorded("circle", sensors, "residual:circle")[:, WORLD : WORLD + ASKED]
    law, openings = make_controller("admittance-backstepping", Parameters()), np.empty((PERIODS, 4))
    for opened, now in zip(openings, seen, strict=True):
        rows = now[:, None]
        said = Measurement(rows[0], rows[1:3], rows[5], rows[3:5], rows[6:10], rows[10:12], sensors == "lab")
        opened[:] = law.command(said, Reference(rows[12:27]))[:, 0]
    inputs = {name: seen[:, number - WORLD] for name, number in ROW.items() if WORLD <= number < WORLD + ASKED}
    mine = [ROW[f"opening_{name}"] for name in CHAMBERS]
    node = node_rows(wasm, ["controller", "admittance-backstepping", sensors], tmp_path, inputs=inputs)
    assert_same_bits(node[:, mine], openings)
    name = f"law_admittance_backstepping_{kind}"
    assert_same_bits(library_rows(library, name, sizes[name] // 8, inputs=inputs)[:, mine], openings)
