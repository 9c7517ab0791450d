"""A rig with worn valves, tubes, a supply that droops and a structure that bends, built."""

import json

import numpy as np
import pytest

from birthsim_build.building import build_c
from birthsim_build.bundle import Bundle
from birthsim_build.code.targets import HOST
from birthsim_build.loops import plant_world
from birthsim_env import Parameters, Plant
from studies.targets.reference import plant_states
from studies.targets.running import ROW, library_rows
from tests.build.targets import assert_same_bits, need_linker

PERIODS = 500
OPTIONS = {
    "worn": {"valves.deadband": 0.02, "valves.hysteresis": 0.01},
    "all": {
        **{"air.supply_conductance": 6e-9, "air.supply_volume": 2e-3},
        **{"chambers.tube_length": 1.0, "mechanics.mode_frequency": 30.0},
    },
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_the_plant_with_options(tmp_path, options):
    need_linker()
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    rig = Parameters().replace(options)
    build = build_c(Bundle(rig, {}, {}, plant_world(rig)), HOST, tmp_path)
    (tmp_path / "build.json").write_text(json.dumps(build))
    inputs, _ = plant_states(PERIODS)
    plant, states = Plant(rig), np.empty((PERIODS, 18))
    for k, state in enumerate(states):
        opening = np.array([inputs[f"opening_{name}"][k] for name in ("P1", "N1", "P2", "N2")])
        force = np.array([inputs["force_x"][k], inputs["force_y"][k]])
        state[:] = plant.advance(opening[:, None], force[:, None], 0.001)[:, 0]
    rows = library_rows(tmp_path, "plant", PERIODS, inputs)
    assert_same_bits(rows[:, ROW["y1"] : ROW["y1"] + 18], states)
