"""What is built computes the bits of Python: closed loops, laws alone and the plant alone; for other processors under qemu."""

import json
from functools import cache

import numpy as np
import pytest

from baselines.named import compiled_names, make_controller
from birthsim_build.building import build_c
from birthsim_build.bundle import Bundle, identifier
from birthsim_build.code.targets import HOST
from birthsim_build.loops import plant_world
from birthsim_env import Parameters, Plant, Reference
from birthsim_env.loop.rows import POSITION, REFERENCE, measurement_of
from lab.studies.targets import reference
from lab.studies.targets.reference import CHAMBERS, PERIODS, SHARED, as_inputs, loop_rows
from lab.studies.targets.running import EMULATED, ROW, emulated_rows, library_rows
from tests.build.targets import BUILT, assert_same_bits, build, need_linker, need_program

LAW = "admittance-backstepping"
CASES = [
    ("ideal", LAW), ("lab", LAW), ("lab", "limited:pid"), ("ideal", "residual:circle"), ("lab", "residual:circle"),
    ("ideal", "residual:circle_honest_student"), ("lab", "residual:circle_honest_student"),
]  # fmt: skip
OPENINGS = [ROW[f"opening_{name}"] for name in CHAMBERS]
KINDS = {"ideal": "exact", "lab": "sampled"}
recorded, law_openings, plant_states = cache(loop_rows), cache(reference.law_openings), cache(reference.plant_states)


def need_emulator(target):
    if HOST is None:
        pytest.skip("qemu runs programs of Linux")
    need_linker()
    need_program(EMULATED[target][1], "qemu-user")


@pytest.fixture(scope="module")
def aarch64(tmp_path_factory):
    need_emulator("aarch64")
    folder = tmp_path_factory.mktemp("aarch64")
    build("aarch64", folder, *BUILT)
    return folder


@pytest.fixture
def in_c(library):
    return lambda name, *make, **options: library_rows(library, name, PERIODS, **options)


@pytest.fixture
def on_aarch64(aarch64):
    return lambda name, *make: emulated_rows("aarch64", aarch64, name, PERIODS)


@pytest.fixture(params=["in_node", "in_c"])
def rows_of(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("place", ["in_node", "in_c", pytest.param("on_aarch64", marks=pytest.mark.weekly)])
@pytest.mark.parametrize(("sensors", "controller"), CASES)
def test_a_closed_loop(request, place, sensors, controller):
    make = "loop", {"scenario": "circle", "sensors": sensors, "controller": controller}
    rows = request.getfixturevalue(place)(f"circle_{sensors}_{identifier(controller)}", *make)
    assert_same_bits(rows[:, SHARED], recorded("circle", sensors, controller)[:, SHARED])


def test_the_plant_alone(rows_of):
    inputs, states = plant_states()
    assert_same_bits(rows_of("plant", "plant", inputs=inputs)[:, ROW["y1"] : ROW["y1"] + 18], states)


@pytest.mark.parametrize("sensors", KINDS)
def test_a_law_alone(rows_of, sensors):
    seen, openings = law_openings(LAW, sensors)
    rows = rows_of(f"law_{identifier(LAW)}_{KINDS[sensors]}", "controller", LAW, sensors, inputs=as_inputs(seen))
    assert_same_bits(rows[:, OPENINGS], openings)


@pytest.fixture(scope="module")
def laws(tmp_path_factory):
    """The folder of a library with every controller."""
    need_linker()
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    folder = tmp_path_factory.mktemp("laws")
    build(HOST, folder, "--controller", *compiled_names(listed=True), "--sensors", *KINDS)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("sensors", KINDS)
def test_every_controller_alone_in_c(laws, sensors):
    for name in compiled_names(listed=True):
        seen, openings = law_openings(name, sensors)
        rows = library_rows(laws, f"law_{identifier(name)}_{KINDS[sensors]}", PERIODS, as_inputs(seen))
        assert_same_bits(rows[:, OPENINGS], openings)


@pytest.mark.parametrize("sensors", KINDS)
def test_a_law_alone_whose_sensors_fail(rows_of, sensors):
    """Single samples, and an outage that ends the control: the openings, the count and the fault of Python."""
    seen = np.array(law_openings(LAW, sensors)[0])
    rng, rows = np.random.default_rng(0), np.arange(REFERENCE)
    for period in rng.choice(np.arange(1, PERIODS - 100), 200, replace=False):
        seen[period, rng.choice(rows, 2)] = rng.choice([np.nan, np.inf, -np.inf, 1e300])
    seen[-100:, POSITION] = np.nan
    law, openings, counted = make_controller(LAW, Parameters()), np.empty((PERIODS, 4)), np.empty((PERIODS, 2))
    for k in range(PERIODS):
        measured = measurement_of(seen[k][:, None], sensors == "lab", False)
        openings[k] = law.command(measured, Reference(seen[k, REFERENCE:][:, None].copy()))[:, 0]
        counted[k] = law.missed[0], 2.0 * law.ended[0]
    rows = rows_of(f"law_{identifier(LAW)}_{KINDS[sensors]}", "controller", LAW, sensors, inputs=as_inputs(seen))
    assert_same_bits(rows[:, OPENINGS], openings)
    assert_same_bits(rows[:, [ROW["missed"], ROW["fault"]]], counted)
    assert (openings[-1] == 0.0).all()
    assert counted[-1, 0] > 200


@pytest.mark.slow
@pytest.mark.weekly
@pytest.mark.parametrize("sensors", KINDS)
def test_a_law_on_cortex_m7(cortex, sensors):
    need_emulator("cortex-m7")
    seen, openings = law_openings(LAW, sensors)
    rows = emulated_rows("cortex-m7", cortex, f"law_{identifier(LAW)}_{KINDS[sensors]}", PERIODS, seen)
    assert_same_bits(rows[:, OPENINGS], openings)


OPTIONS = {
    "worn": {"valves.supply_overlap": 0.02, "valves.hysteresis": 0.01},
    "all": {
        "air.supply_conductance": 6e-9, "air.supply_volume": 2e-3, "chambers.tube_length": 1, "mechanics.mode_frequency": 30,
    },
    "seals": {"friction.law": "gms", "cylinder1.pressure_friction": 5e-6, "cylinder2.direction_asymmetry": 0.2},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",  # the page runs a rig with all of them on every commit
    [pytest.param(options, id=name, marks=pytest.mark.weekly if name == "all" else ()) for name, options in OPTIONS.items()],
)
def test_the_plant_with_options(tmp_path, options):
    need_linker()
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    rig, periods = Parameters().replace(options), 500
    (tmp_path / "build.json").write_text(json.dumps(build_c(Bundle(rig, {}, {}, plant_world(rig)), HOST, tmp_path)))
    inputs, _ = plant_states(periods)
    plant, states = Plant(rig), np.empty((periods, 18))
    given = np.array([inputs[name] for name in (*(f"opening_{chamber}" for chamber in CHAMBERS), "force_x", "force_y")])
    for k, state in enumerate(states):
        state[:] = plant.advance(given[:4, [k]], given[4:, [k]], 0.001)[:, 0]
    assert_same_bits(library_rows(tmp_path, "plant", periods, inputs)[:, ROW["y1"] : ROW["y1"] + 18], states)
