"""Chambers of the plant: balances of mass and energy, and the limits that thermodynamics knows in closed form."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from birthsim_env.physics.compiled.lanes import V1, V2, Y1, Y2, Array
from birthsim_env.physics.dynamics import INTEGRATION_STEP
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from studies.verification.bookkeeper import CP, CV, GAMMA, WALL, Bookkeeper, P, T, Volumes, mass_and_energy

SEALED = {"valves.leakage_ratio": 0.0}
INSULATED = {**SEALED, "chambers.wall_heat_transfer": 0.0, "chambers.piston_conductance": 0.0}
FIXED = {**SEALED, "mechanics.mass": 1e18, "mechanics.gravity": 0.0}
"""Pistons that do not move: their mass is out of reach of the pressures."""


@pytest.mark.slow
def test_mass_and_energy_balance_over_ten_seconds() -> None:
    """Lane by lane other valve motions and pushes, a hand's spring keeping clear of the stops; every chamber's books close."""
    lanes, rng, rig = 6, np.random.default_rng(0), Parameters()
    keeper, check = Bookkeeper(rig, lanes, INTEGRATION_STEP), Plant(rig, lanes)
    centre, worst, reached = check.end_effector()[:2], np.zeros(2), []
    for k in range(500):
        if k % 10 == 0:
            command = rng.uniform(-1, 1, (4, lanes)) * np.linspace(0.1, 1, lanes) * (k % 30 > 0)
            push = rng.uniform(-100, 100, (2, lanes))
        force = push - 2000 * (check.end_effector()[:2] - centre) - 60 * check.end_effector()[2:]
        keeper.advance(command, force, 0.02)
        check.advance(command, force, 0.02)
        worst = np.maximum(worst, keeper.gap())
        reached.append(check.piston)
        assert np.all(check.impacts == 0)
    assert np.all(worst < 1e-7), worst
    assert np.all(np.ptp(reached, axis=0) > [[0.04], [0.05]]), "the chambers' volumes must have changed much"
    np.testing.assert_allclose(keeper.plant.pressures, check.pressures, rtol=1e-6)


def test_balances_hold_through_collisions_with_the_end_stops() -> None:
    """A stop is the fastest event of all; half the default step resolves it to the figure of the balance above."""
    lanes, rng = 36, np.random.default_rng(1)
    keeper, worst, deepest = Bookkeeper(Parameters(), lanes, INTEGRATION_STEP / 2), np.zeros(2), np.zeros((2, lanes))
    outward = rng.choice([-1.0, 1.0], (2, lanes))
    keeper.plant.state[[Y1, Y2]], keeper.plant.state[[V1, V2]] = outward * [[0.08], [0.17]], 0.6 * outward
    keeper.ledger = mass_and_energy(keeper.rig, keeper.plant.state)
    for _ in range(2):
        keeper.advance(rng.choice([-1.0, 1.0], (4, lanes)), rng.uniform(-80, 80, (2, lanes)), 0.1)
        worst, deepest = np.maximum(worst, keeper.gap()), np.maximum(deepest, np.abs(keeper.plant.piston))
    assert np.all(worst < 1e-6), worst
    assert (deepest > [[0.1], [0.2]]).sum() >= 6, "several pistons must have met their stops"


def slow_squeeze(plant: Plant, newtons: float, seconds: float) -> list[Array]:
    """States along half a swing of the user's force on x, valves shut."""
    steps = round(seconds / 0.02)
    states = [plant.state.copy()]
    for k in range(steps):
        force = np.array([[newtons * math.sin(math.pi * (k + 0.5) / steps)], [0.0]])
        states.append(plant.advance(np.zeros((4, 1)), force, 0.02).copy())
    return states


def test_insulated_air_follows_the_adiabat() -> None:
    rig = Parameters().replace(INSULATED)
    states = slow_squeeze(Plant(rig), 150, 1.0)
    invariant = np.array([s[P] * Volumes(rig, s).volume ** GAMMA for s in states])[..., 0]
    volume = np.array([Volumes(rig, s).volume for s in states])[..., 0]
    assert np.all(volume[:, 2:].max(axis=0) > 1.1 * volume[:, 2:].min(axis=0)), "cylinder 2 must be squeezed by 10 %"
    np.testing.assert_allclose(invariant / invariant[0], 1, rtol=0, atol=1e-8)
    warmth = np.array([s[T] * Volumes(rig, s).volume ** (GAMMA - 1) for s in states])[..., 0]
    np.testing.assert_allclose(warmth / warmth[0], 1, rtol=0, atol=1e-8)


def test_air_at_the_walls_temperature_follows_the_isotherm() -> None:
    rig = Parameters().replace({**SEALED, "chambers.wall_heat_transfer": 1e4})
    states = slow_squeeze(Plant(rig), 150, 10.0)
    invariant = np.array([s[P] * Volumes(rig, s).volume for s in states])[..., 0]
    volume = np.array([Volumes(rig, s).volume for s in states])[..., 0]
    assert np.all(volume[:, 2:].max(axis=0) > 1.1 * volume[:, 2:].min(axis=0))
    np.testing.assert_allclose(invariant / invariant[0], 1, rtol=0, atol=5e-4)
    assert max(np.abs(s[T] - WALL).max() for s in states) < 0.15


def test_temperatures_relax_to_the_wall_with_their_time_constant() -> None:
    """At constant volume m cv dT/dt = -h A (T - Twall), alone without the path through the piston."""
    rig = Parameters().replace({**FIXED, "chambers.piston_conductance": 0.0})
    plant = Plant(rig)
    plant.state[T] += np.array([[20.0], [-30.0], [40.0], [-10.0]])
    excess, v = plant.state[T, 0] - WALL, Volumes(rig, plant.state)
    heat_capacity = mass_and_energy(rig, plant.state)[1, :, 0] / plant.state[T, 0]
    tau = heat_capacity / (50.0 * v.wall[:, 0])
    assert np.all((tau > 0.2) & (tau < 1.0)), "cooling takes 0.2 to 1 s with h = 50 W/m2K"
    for seconds in (0.1, 0.3, 1.0):
        relaxed = Plant(rig)
        relaxed.state[:] = plant.state
        relaxed.advance(np.zeros((4, 1)), np.zeros((2, 1)), seconds)
        np.testing.assert_allclose(relaxed.state[T, 0] - WALL, excess * np.exp(-seconds / tau), rtol=1e-9)
        ratio = relaxed.state[P, 0] / relaxed.state[T, 0] / (plant.state[P, 0] / plant.state[T, 0])
        np.testing.assert_allclose(ratio, 1, rtol=1e-10)


def test_heat_passes_through_the_piston() -> None:
    """Two chambers of one cylinder, insulated but for the piston: a linear system, solved by the matrix exponential."""
    rig = Parameters().replace({**FIXED, "chambers.wall_heat_transfer": 0.0, "chambers.piston_conductance": 0.5})
    plant = Plant(rig)
    plant.state[T] += np.array([[50.0], [-20.0], [0.0], [30.0]])
    start = plant.state[T, 0].copy()
    capacity = mass_and_energy(rig, plant.state)[1, :, 0] / start
    energy = mass_and_energy(rig, plant.state)[1, :, 0]
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.4)
    for pair in ([0, 1], [2, 3]):
        matrix = 0.5 * np.array([[-1, 1], [1, -1]]) / capacity[pair][:, None]
        np.testing.assert_allclose(plant.state[T, 0][pair], expm(0.4 * matrix) @ start[pair], rtol=1e-9)
        now = mass_and_energy(rig, plant.state)[1, :, 0]
        assert now[pair].sum() == pytest.approx(energy[pair].sum(), rel=1e-12)


def test_filling_an_insulated_vessel_heats_it_to_gamma_times_the_supply() -> None:
    """The textbook charge: air that enters an almost empty, fixed, insulated vessel ends near gamma Tsupply."""
    rig = Parameters().replace({**FIXED, **INSULATED})
    plant = Plant(rig)
    plant.state[P] = 0.05e5
    before = mass_and_energy(rig, plant.state)[0]
    plant.advance(np.ones((4, 1)), np.zeros((2, 1)), 3.0)
    after = mass_and_energy(rig, plant.state)[0]
    np.testing.assert_allclose(plant.state[P], 7.0e5, rtol=1e-6)
    mixed = (before * CV * WALL + (after - before) * CP * WALL) / (after * CV)
    np.testing.assert_allclose(plant.state[T], mixed, rtol=1e-6)
    assert np.all(plant.state[T] > 1.38 * WALL)
