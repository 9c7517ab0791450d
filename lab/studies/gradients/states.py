"""Random states of drawn rigs, far from rest: what derivatives are compared at."""

import numpy as np

from birthsim_env import Plant
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_columns
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.rig.parameters import load_parameters

SCALES = np.array([0.01, 0.1, 0.01, 0.1, 1e-5, 1e-5, *[1e4, 3.0] * 4, *[0.1] * 4])[:, None]
"""Size of a state's changes."""


def plant_of(lanes: int, seed: int) -> tuple[Plant, Array, Array]:
    """A plant in a random state, openings (4, N) and forces (2, N)."""
    rng, nominal, plant = np.random.default_rng(seed), load_parameters(None), Plant(None, lanes)

    class Streams:
        uniform = staticmethod(lambda low=0.0, high=1.0: rng.uniform(low, high, lanes))

    plant.lane_parameters[:] = draw_columns(nominal, documented_ranges(nominal), Streams, lanes)  # type: ignore[arg-type]
    state = balanced_state(plant.lane_parameters, rng.uniform([[-0.08], [-0.15]], [[0.08], [0.15]], (2, lanes)))
    state[[at.V1, at.V2]] = 0.1 * rng.standard_normal((2, lanes))
    state[[at.Z1, at.Z2]] = 1e-4 * rng.standard_normal((2, lanes))
    state[list(at.PRESSURES)] *= rng.uniform(0.8, 1.3, (4, lanes))
    state[list(at.TEMPERATURES)] += 5 * rng.standard_normal((4, lanes))
    state[list(at.SPOOLS)] = 0.2 * rng.standard_normal((4, lanes))
    plant.state[:] = state
    return plant, np.clip(0.3 * rng.standard_normal((4, lanes)), -1, 1), 20 * rng.standard_normal((2, lanes))
