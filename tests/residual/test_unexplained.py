"""What pistons met: unknown weight and dry friction, told apart by the way that they move."""

from functools import cache

import numpy as np
import pytest

from agents.residual.unexplained import MOVING
from baselines.admittance.controller import AdmittanceController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop, rigid_body
from tests.oracles import derived_law as derived
from tests.oracles.residual_parts import UnexplainedForceObserver

BELIEVED = Parameters()
SLIDING = {"friction.law": "coulomb", "cylinder1.pressure_friction": 0.0, "cylinder2.pressure_friction": 0.0}
"""One level while a piston slides, whatever the pressures are."""
RIGS = [
    BELIEVED.replace({**SLIDING, **changes})
    for changes in (
        {"mechanics.mass": 4.2, "cylinder1.coulomb_friction": 30.0, "cylinder2.coulomb_friction": 21.0},
        {"mechanics.mass": 2.1, "cylinder1.coulomb_friction": 12.0, "cylinder2.coulomb_friction": 5.0},
        {"cylinder1.coulomb_friction": 0.0, "cylinder2.coulomb_friction": 0.0},
    )
]
"""Heavier and rougher than believed; lighter; as believed, without dry friction."""
LANES = len(RIGS)
RATE = 1.6
"""1/s of the sinusoids that both pistons follow: 50 and 80 mm wide, so that inertia is small."""


def wanted(time: float) -> Reference:
    """Pistons go out, back and in, the second a quarter of a period later."""
    angles = RATE * time + np.array([0.0, np.pi / 2])
    joints = np.concatenate([np.array([0.025, 0.04]) * RATE**k * np.sin(angles + k * np.pi / 2) for k in range(4)])
    reference = derived.cartesian(np.repeat(joints[:, None], LANES, axis=1), BELIEVED)
    reference.rows[8:10], reference.rows[10:12] = 3000.0, closed_loop.PNEUMATIC_STIFFNESS
    return reference


PUSH = np.array([[6.0], [-4.0]])
"""N, of a hand whose force is measured: it is no observer."""


@cache
def seen(sensors: str, seconds: float = 5.0) -> tuple[list[Measurement], Array]:
    """What the sensors said of the three rigs while a law moved them, and the true pistons' positions and speeds (T, 4, N)."""
    plant = Plant(RIGS, LANES)
    reference = wanted(0.0)
    plant.state[[0, 2]] = inverse_geometry(reference.position, BELIEVED)
    told = closed_loop.ideal if sensors == "ideal" else closed_loop.tracker(BELIEVED, LANES)
    law, record, truth = AdmittanceController(BELIEVED, learn=False), [], []

    def sense(plant: Plant, time: float, force: Array) -> Measurement:
        record.append(told(plant, time, force))
        truth.append(np.concatenate([plant.piston, plant.piston_speed]))
        return closed_loop.ideal(plant, time, force)

    force = np.repeat(PUSH, LANES, axis=1)
    for _ in closed_loop.run(plant, law.command, wanted, lambda t: force, seconds, sense):
        pass
    return record, np.array(truth)


def course(record: list[Measurement]) -> Array:
    """What was met, (T, Forces.size, N)."""
    observer, path = UnexplainedForceObserver(BELIEVED, LANES), []
    for measured in record:
        observer.update(measured)
        path.append(observer.met.copy())
    return np.array(path)


def unexplained(truth: Array) -> tuple[Array, Array]:
    """By virtual work on the linkage made of points, (T, 2, N), N: the weight along the pistons beyond the one believed in;
    and the dry friction of each, (2, N)."""
    beyond = np.array([rig.mechanics.mass - BELIEVED.mechanics.mass for rig in RIGS])
    weight = np.empty((len(truth), 2, LANES))
    for lane in range(LANES):
        columns = rigid_body.jacobians(truth[:, :2, lane].T, BELIEVED)
        weight[:, :, lane] = -9.81 * beyond[lane] * columns[:, 1, :]
    return weight, np.array([[rig.cylinder1.coulomb_friction, rig.cylinder2.coulomb_friction] for rig in RIGS]).T


@pytest.mark.parametrize(
    ("sensors", "fraction", "close"), [pytest.param("ideal", 0.9, 1.0, marks=pytest.mark.weekly), ("lab", 0.5, 5.0)]
)
def test_friction_opposes_both_ways_and_weight_neither(sensors: str, fraction: float, close: float) -> None:
    """Out: too much weight, less friction; in: the same and friction. Within 1 N of 57 N, but for the instants after a turn."""
    record, truth = seen(sensors)
    met = course(record)
    weight, friction = unexplained(truth)
    for cylinder in range(2):
        speed, errors = truth[:, 2 + cylinder], []
        for way, sign in ((0, 1), (1, -1)):
            for lane in range(LANES):
                slides = sign * speed[:, lane] > MOVING
                for instant in range(2500, 5000, 20):
                    window = np.flatnonzero(slides[:instant])[-200:]
                    expected = weight[window, cylinder, lane].mean() - sign * friction[cylinder, lane]
                    errors.append(abs(met[instant, 2 + 2 * way + cylinder, lane] - expected))
        assert np.quantile(errors, fraction) < close
        fast = (np.abs(speed) > 0.02) & (np.arange(len(speed)) > 500)[:, None]
        expected = weight[:, cylinder] - np.sign(speed) * friction[cylinder]
        assert np.quantile(np.abs(met[:, cylinder] - expected)[fast], fraction) < close
    # Something was there to be told apart.
    assert np.ptp(met[-1, 2:]) > 50


def test_the_way_not_taken_yet_shows_what_is_met_now_and_a_resting_piston_keeps_both() -> None:
    record, truth = seen("ideal")
    met, lane = course(record), 0
    for cylinder in range(2):
        speed = truth[:, 2 + cylinder, lane]
        for way, sign in ((0, 1), (1, -1)):
            row = met[:, 2 + 2 * way + cylinder, lane]
            first = int(np.argmax(sign * speed > MOVING))
            np.testing.assert_array_equal(row[:first], met[:first, cylinder, lane])
            # Afterwards it changes only while the piston moves that way.
            slow = np.flatnonzero(sign * speed < 0.9 * MOVING)
            slow = slow[slow > first]
            np.testing.assert_array_equal(row[slow], row[slow - 1])
            assert len(slow) > 500
