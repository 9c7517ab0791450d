"""Laws that the plant keeps in any state of any rig: balances of mass and energy, order of lanes."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.bookkeeper import mass_and_energy, sources
from tests.physics.rigs import LAWS
from tests.physics.test_dynamics import anywhere


def rig_of(rng: np.random.Generator) -> Parameters:
    """A rig out of the documented ranges, with one of the three friction laws."""
    drawn = {name: float(rng.uniform(*bounds)) for name, bounds in documented_ranges(Parameters()).items()}
    return Parameters().replace({**drawn, "friction.law": str(rng.choice(LAWS))})


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32))
def test_air_and_its_energy_are_balanced_in_any_state(seed):
    """What chambers hold changes along the plant's rates as bookkeeping of flows, work and heat says."""
    rig, step = rig_of(np.random.default_rng(seed)), 1e-7
    plant, command, push = anywhere(rig, 8, seed)
    state = plant.state.copy()
    rates, due = plant.derivatives(state, command, push), sources(rig, state, plant.mass_flows())
    found = (mass_and_energy(rig, state + step * rates) - mass_and_energy(rig, state - step * rates)) / (2 * step)
    for one, other in zip(found, due, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-7 * np.abs(other).max())


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
    state = anywhere(Parameters(), lanes, seed)[0].state
    actions, forces = rng.uniform(-1, 1, (5, 4, lanes)), rng.normal(0, 40, (5, 2, lanes))
    together = moved(rigs, state, actions, forces)
    order = rng.permutation(lanes)
    shuffled = moved([rigs[k] for k in order], state[:, order], actions[:, :, order], forces[:, :, order])
    np.testing.assert_array_equal(shuffled, together[:, order])
    cut = min(cut, lanes - 1)
    for part in (slice(0, cut), slice(cut, lanes)):
        alone = moved(rigs[part], np.ascontiguousarray(state[:, part]), actions[:, :, part], forces[:, :, part])
        np.testing.assert_array_equal(alone, together[:, part])
