"""Balances of the plant: books of mass and energy close with the order of the step, insulated air, work of the pistons."""

import numpy as np
import pytest

from birthsim_env.physics.compiled.lanes import V1, V2, Y1, Y2
from birthsim_env.physics.dynamics import INTEGRATION_STEP
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.bookkeeper import GAMMA, KEEPING, Bookkeeper, P, Volumes
from tests.physics.rigs import PRESSED, UNLIKE

RIG = Parameters()


def gap(step: float, collide: bool, rig: Parameters = RIG) -> float:
    """Largest relative gap between books and chambers over 0.2 s with random valves and pushes."""
    rng, lanes = np.random.default_rng(0), 6
    keeper = Bookkeeper(rig, lanes, step)
    if collide:
        start = keeper.plant.state.copy()
        outward = rng.choice([-1.0, 1.0], (2, lanes))
        start[[Y1, Y2]], start[[V1, V2]] = outward * [[0.08], [0.17]], 0.6 * outward
        keeper = Bookkeeper(rig, lanes, step, start)
    deepest = np.zeros((2, lanes))
    for _ in range(2):
        command, push = rng.uniform(-1, 1, (4, lanes)), rng.uniform(-100, 100, (2, lanes))
        for _mark in range(5):
            keeper.advance(command, push, 0.02)
            deepest = np.maximum(deepest, np.abs(keeper.plant.piston))
    assert (deepest > [[0.1], [0.2]]).any() == collide
    return float(keeper.gap().max())


@pytest.mark.parametrize("collide", [False, True], ids=["clear of the stops", "through the stops"])
def test_the_books_close_at_least_with_the_order_of_the_step(collide: bool) -> None:
    coarse, fine = (gap(factor * KEEPING, collide) for factor in ((1, 0.5) if collide else (2, 1)))
    assert fine < 1e-7
    assert coarse > 8 * fine


def test_the_books_close_with_valves_of_which_no_edge_is_as_another() -> None:
    assert gap(KEEPING, False, RIG.replace(UNLIKE)) < 1e-7


def test_insulated_shut_chambers_keep_their_adiabat() -> None:
    """P V^gamma stays while a hand of 150 N squeezes the air for a second."""
    shut = {"valves.leakage_ratio": 0.0, "chambers.wall_heat_transfer": 0.0, "chambers.piston_conductance": 0.0}
    rig = RIG.replace(shut)
    plant = Plant(rig)
    volumes, invariants = [], []
    for k in range(50):
        volumes.append(Volumes(rig, plant.state).volume)
        invariants.append(plant.state[P] * volumes[-1] ** GAMMA)
        plant.advance(np.zeros((4, 1)), np.array([[150 * np.sin(np.pi * (k + 0.5) / 50)], [0.0]]), 0.02)
    assert (np.max(volumes, axis=0) / np.min(volumes, axis=0)).max() > 1.2
    np.testing.assert_allclose(np.array(invariants) / invariants[0], 1.0, rtol=3e-9)


def mechanical_gap(rig: Parameters, step: float) -> float:
    """Gap of m v^2/2 + m g y against the work of pressures and hand, less friction, relative to the work done."""
    lanes, rng, plant = 6, np.random.default_rng(1), Plant(rig, 6)
    mass, weight = rig.mechanics.mass, rig.mechanics.mass * rig.mechanics.gravity

    def energy() -> np.ndarray:
        motion = plant.end_effector()
        return 0.5 * mass * (motion[2] ** 2 + motion[3] ** 2) + weight * motion[1]

    def power(push: np.ndarray) -> np.ndarray:
        # What the pistons pass on: m a = F, so that power is force times speed of each piston, friction taken off.
        rates, motion = plant.derivatives(plant.state, np.zeros((4, lanes)), push), plant.end_effector()
        s, friction = plant.state, rig.friction
        total = push[0] * motion[2] + push[1] * motion[3]
        for row, cylinder, pp, pn in ((0, rig.cylinder1, 6, 8), (2, rig.cylinder2, 10, 12)):
            speed, bristle = s[row + 1], s[4 + row // 2]
            net = s[pp] * cylinder.area_p - s[pn] * cylinder.area_n
            net = net - rig.air.atmospheric_pressure * (cylinder.area_p - cylinder.area_n)
            drag = friction.bristle_stiffness * bristle + friction.bristle_damping * rates[4 + row // 2]
            total = total + (net - drag - cylinder.viscous_friction * speed) * speed
        return total

    start, work, moved = energy(), np.zeros(lanes), np.zeros(lanes)
    for k in range(round(0.4 / step)):
        if k % round(0.1 / step) == 0:
            push = rng.uniform(-60, 60, (2, lanes))
        before = power(push)
        plant.advance(np.zeros((4, lanes)), push, step)
        mean = 0.5 * (before + power(push)) * step
        work, moved = work + mean, moved + np.abs(mean)
    assert moved.max() > 1
    return float((np.abs(energy() - start - work) / moved).max())


@pytest.mark.parametrize("changes", [{}, PRESSED], ids=["default", "pressed"])
def test_mechanical_energy_is_the_work_of_pressures_and_hand_less_friction(changes: dict[str, float]) -> None:
    """Trapezoids of one step sum the work, which are of second order: the gap is theirs."""
    gaps = [mechanical_gap(RIG.replace(changes), factor * INTEGRATION_STEP) for factor in (1, 0.5)]
    assert gaps[0] < 1e-4
    assert gaps[0] > 3 * gaps[1]
