"""Laws that the plant keeps in any state of any rig: balances of mass and energy, order of lanes."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.physics.rigs import LAWS

CHAMBERS = (
    (at.PP1, at.TP1, at.TN1, at.AREA_P1, at.PERIMETER1, at.HALF_L1, at.Y1, at.V1, 1.0),
    (at.PN1, at.TN1, at.TP1, at.AREA_N1, at.PERIMETER1, at.HALF_L1, at.Y1, at.V1, -1.0),
    (at.PP2, at.TP2, at.TN2, at.AREA_P2, at.PERIMETER2, at.HALF_L2, at.Y2, at.V2, 1.0),
    (at.PN2, at.TN2, at.TP2, at.AREA_N2, at.PERIMETER2, at.HALF_L2, at.Y2, at.V2, -1.0),
)


def rig_of(rng: np.random.Generator) -> Parameters:
    """A rig out of the documented ranges, with one of the three friction laws."""
    drawn = {name: float(rng.uniform(*bounds)) for name, bounds in documented_ranges(Parameters()).items()}
    return Parameters().replace({**drawn, "friction.law": str(rng.choice(LAWS))})


def state_of(plant: Plant, rng: np.random.Generator) -> np.ndarray:
    """Any state inside the physical range."""
    state, lanes = plant.state.copy(), plant.num_envs
    for y, v, half in ((at.Y1, at.V1, at.HALF_L1), (at.Y2, at.V2, at.HALF_L2)):
        state[y] = rng.uniform(-0.98, 0.98, lanes) * plant.lane_parameters[half]
        state[v] = rng.normal(0, 0.3, lanes)
    for pressure, temperature, *_ in CHAMBERS:
        state[pressure], state[temperature] = rng.uniform(0.5e5, 12e5, lanes), rng.uniform(200, 450, lanes)
    state[list(at.SPOOLS)] = rng.uniform(-1, 1, (4, lanes))
    return state


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32))
def test_air_and_its_energy_are_balanced_in_any_state(seed):
    rng = np.random.default_rng(seed)
    plant = Plant([rig_of(rng) for _ in range(4)], 4)
    p, state = plant.lane_parameters, state_of(plant, rng)
    plant.state = state
    rates = plant.derivatives(state, rng.uniform(-1, 1, (4, 4)), rng.normal(0, 50, (2, 4)))
    flows = plant.mass_flows()
    for k, (pressure, temperature, other, area, perimeter, half, y, v, sign) in enumerate(CHAMBERS):
        length, length_rate = p[half] + sign * state[y], sign * state[v]
        volume, volume_rate = p[at.DEAD_VOLUME] + p[area] * length, p[area] * length_rate
        P, T, dP, dT = state[pressure], state[temperature], rates[pressure], rates[temperature]
        mass = P * volume / (p[at.GAS] * T)
        supplied, exhausted = flows[k], flows[4 + k]
        growth = mass * (dP / P + volume_rate / volume - dT / T)
        size = np.abs(supplied) + np.abs(exhausted) + mass
        np.testing.assert_allclose(growth, supplied - exhausted, atol=1e-9 * size.max())
        source, cv = p[at.TEMPERATURE], p[at.GAS] / (p[at.GAMMA] - 1)
        carried = source * (np.maximum(supplied, 0) - np.minimum(exhausted, 0)) - T * (
            np.maximum(exhausted, 0) - np.minimum(supplied, 0)
        )
        heat = p[at.H_WALL] * (2 * p[area] + p[perimeter] * length) * (source - T) + p[at.G12] * (state[other] - T)
        energy = cv * (growth * T + mass * dT)
        due = (cv + p[at.GAS]) * carried + heat - P * volume_rate
        np.testing.assert_allclose(energy, due, rtol=1e-7, atol=1e-7 * np.abs(due).max())


def moved(rigs, state, actions, forces):
    plant = Plant(rigs, len(rigs))
    plant.state = state
    for command, force in zip(actions, forces, strict=True):
        plant.advance(command, force, 0.01)
    return plant.state.copy()


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32), lanes=st.integers(2, 70), cut=st.integers(1, 69))
def test_order_and_company_of_lanes_change_no_bit(seed, lanes, cut):
    rng = np.random.default_rng(seed)
    rigs = [rig_of(rng) for _ in range(lanes)]
    state = state_of(Plant(rigs, lanes), rng)
    actions, forces = rng.uniform(-1, 1, (5, 4, lanes)), rng.normal(0, 40, (5, 2, lanes))
    together = moved(rigs, state, actions, forces)
    order = rng.permutation(lanes)
    shuffled = moved([rigs[k] for k in order], state[:, order], actions[:, :, order], forces[:, :, order])
    np.testing.assert_array_equal(shuffled, together[:, order])
    cut = min(cut, lanes - 1)
    for part in (slice(0, cut), slice(cut, lanes)):
        alone = moved(rigs[part], np.ascontiguousarray(state[:, part]), actions[:, :, part], forces[:, :, part])
        np.testing.assert_array_equal(alone, together[:, part])
