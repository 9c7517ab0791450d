"""Chambers of the plant: balances of mass and energy, and heat in closed form."""

import numpy as np
import pytest
from scipy.linalg import expm

from birthsim_env.physics.compiled.lanes import V1, V2, Y1, Y2
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.bookkeeper import KEEPING, WALL, Bookkeeper, P, T, Volumes, mass_and_energy

FIXED = {"valves.leakage_ratio": 0.0, "mechanics.mass": 1e18, "mechanics.gravity": 0.0}
"""Pistons that do not move: their mass is out of reach of the pressures."""


@pytest.mark.slow
def test_mass_and_energy_balance_over_ten_seconds() -> None:
    """Lane by lane other valve motions and pushes, a hand's spring keeping clear of the stops; every chamber's books close.

    The plant's own method makes the same motion for a second; later, forces that follow only one of both let them part.
    """
    lanes, rng, rig = 6, np.random.default_rng(0), Parameters()
    keeper, check = Bookkeeper(rig, lanes, KEEPING), Plant(rig, lanes)
    centre, worst, apart, reached = check.end_effector()[:2], np.zeros(2), 0.0, []
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
        if k < 50:
            apart = max(apart, np.abs(keeper.plant.pressures / check.pressures - 1).max())
    assert apart < 4e-5
    # A corner of the flow, where a spool leaves its overlap, opens the books threefold; half the step leaves a fourteenth.
    assert np.all(worst < 2e-7), worst
    assert np.all(np.ptp(reached, axis=0) > [[0.04], [0.05]]), "the chambers' volumes must have changed much"


def test_balances_hold_through_collisions_with_the_end_stops() -> None:
    """A stop is the fastest event of all; half the usual step resolves it to the figure of the balance above."""
    lanes, rng = 36, np.random.default_rng(1)
    keeper, worst, deepest = Bookkeeper(Parameters(), lanes, KEEPING / 2), np.zeros(2), np.zeros((2, lanes))
    outward = rng.choice([-1.0, 1.0], (2, lanes))
    keeper.plant.state[[Y1, Y2]], keeper.plant.state[[V1, V2]] = outward * [[0.08], [0.17]], 0.6 * outward
    keeper.ledger = mass_and_energy(keeper.rig, keeper.plant.state)
    for _ in range(2):
        keeper.advance(rng.choice([-1.0, 1.0], (4, lanes)), rng.uniform(-80, 80, (2, lanes)), 0.1)
        worst, deepest = np.maximum(worst, keeper.gap()), np.maximum(deepest, np.abs(keeper.plant.piston))
    assert np.all(worst < 1e-6), worst
    assert (deepest > [[0.1], [0.2]]).sum() >= 6, "several pistons must have met their stops"


def test_heat_passes_to_the_wall_and_through_the_piston() -> None:
    """Chambers of constant volume: m cv dT/dt = h A (Twall - T) + G (Tother - T), solved by the matrix exponential."""
    rig = Parameters().replace({**FIXED, "chambers.piston_conductance": 0.5})
    plant = Plant(rig)
    plant.state[T] += np.array([[50.0], [-20.0], [0.0], [30.0]])
    before, wall = plant.state[:, 0].copy(), rig.chambers.wall_heat_transfer * Volumes(rig, plant.state).wall[:, 0]
    capacity = mass_and_energy(rig, plant.state)[1, :, 0] / before[T]
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.4)
    for pair in ([0, 1], [2, 3]):
        matrix = (0.5 * np.array([[-1, 1], [1, -1]]) - np.diag(wall[pair])) / capacity[pair][:, None]
        expected = WALL + expm(0.4 * matrix) @ (before[T][pair] - WALL)
        np.testing.assert_allclose(plant.state[T, 0][pair], expected, rtol=1e-9)
    np.testing.assert_allclose(plant.state[P, 0] / plant.state[T, 0], before[P] / before[T], rtol=1e-10)
