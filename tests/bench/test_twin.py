"""The hand-written C of the plant computes what the kernel computes, but for rounding."""

import numpy as np
import pytest

from birthsim_env import Parameters, Plant
from birthsim_env.physics.compiled.lanes import HALF_L1, HALF_L2, V1, V2, Y1, Y2
from birthsim_env.physics.dynamics import INTEGRATION_STEP, steps_in
from lab.studies.speed.twin import PLAIN, Twin, has_compiler

pytestmark = pytest.mark.skipif(not has_compiler(), reason="no gcc")

LANES = 37  # a whole block and a part of one
ROUNDING = 1e-9
"""Largest difference, relative to the largest value in a row. An operation rounds by 1.1e-16; 1600 evaluations of some 500 of
them leave 1e-15 to 1e-13, and up to 1e-11 where a piston meets its end stop a trifle earlier (20 seeds, three friction laws).
The tolerance leaves a hundredfold for other compilers; what a wrong formula or row leaves is far above it."""


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    return Twin(tmp_path_factory.mktemp("twin"), PLAIN)


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic", "coulomb"])
def test_the_twin_is_the_plant_but_for_rounding(twin, law):
    rng = np.random.default_rng(7)
    rigs = []
    for _ in range(LANES):
        drawn = {"friction.static_ratio": (1.0, 2.0), "mechanics.mass": (1.5, 4.5), "valves.critical_ratio": (0.2, 0.5)}
        figures = {name: rng.uniform(*ends) for name, ends in drawn.items()}
        rigs.append(Parameters().replace({"friction.law": law, **figures}))
    plant = Plant(rigs, LANES)
    side = rng.choice([-1.0, 1.0], (2, LANES))
    plant.state[[Y1, Y2]] = side * rng.uniform(0.8, 1.0, (2, LANES)) * plant.lane_parameters[[HALF_L1, HALF_L2]]
    plant.state[[V1, V2]] = side * rng.uniform(0.0, 0.5, (2, LANES))
    state, impacts, hits = plant.state.copy(), np.empty((2, LANES)), 0
    for _ in range(10):
        command = rng.uniform(-1.0, 1.0, (4, LANES))
        forces = rng.uniform(-150.0, 150.0, (10, 2, LANES))
        plant.advance(command, forces, 0.01)
        twin.advance(state, command, forces, plant.lane_parameters, steps_in(1e-3), INTEGRATION_STEP, impacts)
        scale = np.maximum(np.abs(plant.state).max(axis=1, keepdims=True), 1e-30)
        assert np.abs((state - plant.state) / scale).max() < ROUNDING
        np.testing.assert_allclose(impacts, plant.impacts, rtol=0.0, atol=ROUNDING)
        hits += np.count_nonzero(impacts)
    assert hits > LANES // 2, "pistons ran into end stops"


def test_gcc_says_what_is_wrong(tmp_path):
    with pytest.raises(ValueError, match=r"gcc -fno-such-thing .*unrecognized command-line option"):
        Twin(tmp_path, ("-fno-such-thing",))
