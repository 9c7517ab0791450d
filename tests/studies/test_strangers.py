"""Rigs that the model lacks: each of their strangenesses against something that it must be, and the study's pieces."""

import numpy as np
import pytest

from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.accuracy.motions import PERIOD, strong
from lab.studies.accuracy.second_model import SecondModel, rates
from lab.studies.strangers.model import RESERVOIR, STEP, Strangeness, Stranger, strange_rates

pytestmark = pytest.mark.slow

SHUT, NO_PUSH = np.zeros(4), np.zeros(2)
TIGHT = Parameters().replace({"valves.leakage_ratio": 0.0})


def start(rig: Parameters = TIGHT, extension: float = 0.0, **odd: float) -> tuple[Stranger, SecondModel]:
    """Both with pistons at this extension, m, cylinder 1 on its way out, 2 on its way in."""
    plant = Plant(rig)
    plant.state[:] = balanced_state(plant.lane_parameters, np.full((2, 1), extension), np.array([[0.1], [-0.2]]))
    begun = plant.end_effector()[:, 0], plant.state[:, 0]
    return Stranger(rig, Strangeness(**odd), *begun), SecondModel(rig, *begun)


def slope(stranger: Stranger) -> np.ndarray:
    return strange_rates(stranger.state, SHUT, NO_PUSH, *stranger._constants)


def test_with_nothing_strange_it_is_the_second_model() -> None:
    stranger, second = start(Parameters())
    for k in range(30):
        stranger.advance(*strong(k), PERIOD)
        second.advance(*strong(k), PERIOD)
    # Steps of order 4 beside an adaptive method of order 8, over kinks of the friction.
    np.testing.assert_allclose(stranger.state[:2], second.state[:2], rtol=0, atol=1e-7)
    np.testing.assert_allclose(stranger.air[0], second.pressures, rtol=1e-6)


# The wave is 0.1 m long: none in the middle, most a quarter of it outwards, least a quarter inwards.
WAVE = [({"friction_wave": 0.3}, 0.025 * way, (1 + 0.3 * way,) * 2) for way in (0, 1, -1)]


@pytest.mark.parametrize(("odd", "extension", "factors"), [({"friction_asymmetry": 0.3}, 0.0, (1.3, 0.7)), *WAVE])
def test_friction_is_that_of_a_rig_with_so_much_of_it(odd, extension, factors) -> None:
    names = ("cylinder1.coulomb_friction", "cylinder2.coulomb_friction")
    levels = (TIGHT.cylinder1.coulomb_friction, TIGHT.cylinder2.coulomb_friction)
    rig = TIGHT.replace({name: factor * level for name, factor, level in zip(names, factors, levels, strict=True)})
    stranger, second = start(extension=extension, **odd)
    wanted = rates(second.state, SHUT, NO_PUSH, *start(rig, extension)[1].constants)
    np.testing.assert_allclose(slope(stranger)[:18], wanted, rtol=1e-12, atol=1e-11)


def test_a_leak_takes_air_and_its_energy_from_the_fuller_chamber_to_the_other() -> None:
    stranger = start(piston_leak=5e-10)[0]
    moved = slope(stranger) - slope(start()[0])
    mass, energy, higher = moved[4:8].reshape(2, 2), moved[8:12].reshape(2, 2), np.diff(stranger.air[0].reshape(2, 2))[:, 0]
    np.testing.assert_allclose(mass.sum(axis=1), 0.0, atol=1e-15)
    np.testing.assert_allclose(energy.sum(axis=1), 0.0, atol=1e-9)
    assert np.all(np.sign(mass[:, 0]) == np.sign(higher))
    # The balance begins as warm as the walls: cp times that is what a kilogram takes along.
    gas = TIGHT.air
    enthalpy = gas.heat_capacity_ratio * gas.gas_constant / (gas.heat_capacity_ratio - 1) * gas.temperature
    np.testing.assert_allclose(energy, enthalpy * mass, rtol=1e-9)


def test_a_line_fills_a_reservoir_and_no_air_comes_from_nowhere() -> None:
    """With a shut line the chambers get what the reservoir loses, at the walls' temperature."""
    stranger, _ = start(line_conductance=1e-16)
    gas = TIGHT.air

    def held() -> float:
        reservoir = stranger.state[18] * RESERVOIR / (gas.gas_constant * gas.temperature)
        return float(reservoir + stranger.state[4:8].sum())

    before, chambers = held(), stranger.state[4:8].sum()
    for _ in range(20):
        stranger.advance(np.full(4, 0.5), NO_PUSH, 1e-3)
    assert stranger.state[4:8].sum() > 1.05 * chambers
    assert held() == pytest.approx(before, rel=1e-9)


def test_a_spool_of_second_order_answers_as_one() -> None:
    stranger, frequency, damping = start(spool_frequency=60.0)[0], 2 * np.pi * 60.0, 0.7
    begin, steps = stranger.state[14].copy(), 200
    stranger.advance(np.full(4, begin + 0.5), NO_PUSH, steps * STEP)
    time, ringing = steps * STEP, frequency * np.sqrt(1 - damping**2)
    decay = np.exp(-damping * frequency * time)
    wanted = 1 - decay * (np.cos(ringing * time) + damping * frequency / ringing * np.sin(ringing * time))
    assert stranger.state[14] == pytest.approx(begin + 0.5 * wanted, abs=1e-7)


def test_a_handle_takes_no_momentum() -> None:
    """What cylinders and weight give to both bodies is what a rigid one gets."""
    stranger, second = start(handle_frequency=30.0)
    found, mass = slope(stranger), TIGHT.mechanics.mass
    handle = 0.2 * mass
    both = handle * found[25:27] + (mass - handle) * found[2:4]
    np.testing.assert_allclose(both, mass * rates(second.state, SHUT, NO_PUSH, *second.constants)[2:4], rtol=1e-9)


def test_play_and_delay() -> None:
    stranger, tau = start(play=0.02)[0], TIGHT.valves.time_constant
    for command in (0.5, 0.49, 0.485):
        stranger.advance(np.full(4, command), NO_PUSH, 20 * tau)
        np.testing.assert_allclose(stranger.state[14:18], 0.49, atol=1e-6)
    late = start(delay=0.002)[0]
    before = late.state[14:18].copy()
    for _ in range(2):
        late.advance(np.ones(4), NO_PUSH, 1e-3)
        np.testing.assert_allclose(late.state[14:18], before, atol=1e-12)
    late.advance(np.ones(4), NO_PUSH, 1e-3)
    np.testing.assert_allclose(late.state[14:18], 1 + (before - 1) * np.exp(-1e-3 / tau), atol=1e-9)
