"""PID, LQR and sliding mode on the plant: stiffness, saturation, and what their observer is told."""

import dataclasses

import numpy as np
import pytest

from baselines.rivals.lqr import LinearQuadratic
from baselines.rivals.pid import PositionPID
from baselines.rivals.sliding_mode import SlidingMode
from baselines.rivals.tracking import Integrals, TrackingController
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles.observed import Sampled

RIVALS = (PositionPID, LinearQuadratic, SlidingMode)
every_rival = pytest.mark.parametrize("rival", RIVALS, ids=lambda kind: kind.__name__)


def integrals(law: TrackingController) -> Array:
    """Of cylinders 1 and 2, (2, N)."""
    return Integrals(law._memories[-1]).integral.copy()


@every_rival
def test_a_rival_renders_the_stiffness(rival: type[TrackingController]) -> None:
    """LuGre friction, a rig 1 kg heavier than believed: pushed by 20 N, it gives way as asked, in any direction."""
    stiffness = np.array([[1000.0, 2000.0, 4000.0, 2000.0], [1000.0, 2000.0, 4000.0, 4000.0]])
    reference = closed_loop.holding(np.repeat([[0.5], [0.02]], 4, axis=1), stiffness)
    reference.rows[14] = [0.0, 0.0, 0.0, 800.0]
    plant = closed_loop.resting_at(reference, Parameters().replace({"mechanics.mass": 4.0}))
    push = np.array([[20.0, 0.0, -20.0, 12.0], [0.0, -20.0, 0.0, 16.0]])
    for _ in closed_loop.run(plant, rival().command, lambda t: reference, lambda t: push * np.clip(t, 0, 1), 2.5):
        pass
    expected = [
        np.linalg.solve([[kx, kxy], [kxy, ky]], f)
        for (kx, ky), kxy, f in zip(stiffness.T, reference.rows[14], push.T, strict=True)
    ]
    np.testing.assert_allclose(plant.end_effector()[:2] - reference.position, np.transpose(expected), atol=6e-4)


@every_rival
def test_integrals_rest_while_a_valve_is_full(rival: type[TrackingController]) -> None:
    """Half a second far from the target, then back on it: no more than the integral's start remains (no windup)."""
    law, position = rival(), np.array([[0.5], [0.0]])
    reference = closed_loop.holding(position, 2000.0)
    plant = closed_loop.resting_at(reference, Parameters())
    near = closed_loop.ideal(plant, 0.0, np.zeros((2, 1)))
    first = law.command(near, reference)
    far = dataclasses.replace(near, position=position + np.array([[0.06], [0.06]]))
    openings = np.array([law.command(far, reference) for _ in range(500)])
    assert np.all(np.abs(openings).reshape(500, 2, 2).max(axis=2) == 1)
    np.testing.assert_allclose(law.command(near, reference), first, atol=1e-12)


def test_the_integral_of_the_pid_rests_while_the_supply_gives_no_more() -> None:
    """Full chambers need no open valve: the limit of the force itself holds the integral."""
    rig, law = Parameters(), PositionPID(integral_rate=10.0)
    reference = closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0)
    full, empty = rig.air.supply_pressure, rig.air.atmospheric_pressure
    start = closed_loop.ideal(closed_loop.resting_at(reference, rig), 0.0, np.zeros((2, 1)))
    for offset, pressures in ((-0.06, [empty, full, full, empty]), (0.06, [full, empty, empty, full])):
        changes = {"position": start.position + offset * np.array([[1.0], [1.0]]), "pressures": np.array(pressures)[:, None]}
        law.reset()
        law.command(dataclasses.replace(start, position=changes["position"]), reference)
        before = integrals(law)
        for _ in range(10):
            openings = law.command(dataclasses.replace(start, **changes), reference)
        assert np.abs(openings).max() < 1
        assert np.array_equal(integrals(law), before)


@every_rival
def test_the_observer_is_told_what_is_known(rival: type[TrackingController]) -> None:
    """The measured force, and in which lanes the compliant motion is faster than 1 mm/s."""
    law, rig, seen = rival(), Parameters(), []
    told, reference = Sampled(rig), closed_loop.holding(np.repeat([[0.5], [0.0]], 2, axis=1), 2000.0)
    plant, nothing = closed_loop.resting_at(reference, rig), np.zeros((2, 2))
    reference.rows[2] = [2e-3, 5e-4]

    def command(measured, reference):
        seen.append(measured)
        told.update(measured, nothing, moving=np.array([1.0, 0.0]))
        return law.command(measured, reference)

    for _ in closed_loop.run(plant, command, lambda t: reference, lambda t: nothing, 0.04, closed_loop.tracker(rig, 2)):
        pass
    assert np.array_equal(law._memories[1], told.pistons.rows)
    assert told.pistons.rest[0, 0] == 0 < told.pistons.rest[0, 1]
    pushed = dataclasses.replace(seen[-1], user_force=np.full((2, 2), 3.0))
    law.command(pushed, reference)
    told.update(pushed, pushed.user_force, moving=np.ones(2))
    assert np.array_equal(law._memories[1][:, 0], told.pistons.rows[:, 0])
