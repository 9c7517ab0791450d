"""What is built computes the bits of Python: closed loops, laws alone and the plant alone."""

from functools import cache

import pytest

from birthsim_build.bundle import identifier
from studies.targets import reference
from studies.targets.reference import CHAMBERS, PERIODS, SHARED, as_inputs, loop_rows
from studies.targets.running import ROW, library_rows, node_rows
from tests.build.targets import assert_same_bits, need_program

CASES = [
    ("ideal", "admittance-backstepping"),
    ("lab", "admittance-backstepping"),
    ("lab", "limited:pid"),
    ("ideal", "residual:circle"),
    ("lab", "residual:circle"),
    ("ideal", "residual:circle_honest_student"),
    ("lab", "residual:circle_honest_student"),
]
OPENINGS = [ROW[f"opening_{name}"] for name in CHAMBERS]
recorded, law_openings, plant_states = cache(loop_rows), cache(reference.law_openings), cache(reference.plant_states)


@pytest.fixture
def in_node(wasm, tmp_path):
    need_program("node", "nodejs")
    return lambda *make, **options: node_rows(wasm, list(make), tmp_path, PERIODS, **options)[0]


@pytest.mark.parametrize(("sensors", "controller"), CASES)
def test_a_closed_loop_in_webassembly(in_node, sensors, controller):
    rows = in_node("loop", {"scenario": "circle", "sensors": sensors, "controller": controller})
    assert_same_bits(rows[:, SHARED], recorded("circle", sensors, controller)[:, SHARED])


@pytest.mark.parametrize(("sensors", "controller"), CASES)
def test_a_closed_loop_in_c(library, sensors, controller):
    rows = library_rows(library, f"circle_{sensors}_{identifier(controller)}", PERIODS)
    assert_same_bits(rows[:, SHARED], recorded("circle", sensors, controller)[:, SHARED])


def test_the_plant_alone_in_webassembly(in_node):
    inputs, states = plant_states()
    assert_same_bits(in_node("plant", inputs=inputs)[:, ROW["y1"] : ROW["y1"] + 18], states)


def test_the_plant_alone_in_c(library):
    inputs, states = plant_states()
    assert_same_bits(library_rows(library, "plant", PERIODS, inputs)[:, ROW["y1"] : ROW["y1"] + 18], states)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_a_law_alone_in_webassembly(in_node, sensors):
    seen, openings = law_openings("admittance-backstepping", sensors)
    rows = in_node("controller", "admittance-backstepping", sensors, inputs=as_inputs(seen))
    assert_same_bits(rows[:, OPENINGS], openings)


@pytest.mark.parametrize(("sensors", "kind"), [("ideal", "exact"), ("lab", "sampled")])
def test_a_law_alone_in_c(library, sensors, kind):
    seen, openings = law_openings("admittance-backstepping", sensors)
    rows = library_rows(library, f"law_admittance_backstepping_{kind}", PERIODS, as_inputs(seen))
    assert_same_bits(rows[:, OPENINGS], openings)
