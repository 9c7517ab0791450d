"""What sensors show on a rail: of the locked cylinder what is there, without an error, so that no law answers to it."""

import gymnasium
import numpy as np
import pytest

from baselines.driving import driving
from baselines.named import make_controller
from birthsim_env.parts.sensors.joint_board import JointErrors
from birthsim_env.parts.sensors.sensor_errors import Errors
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names

PERIODS = 400
RAIL = Parameters().replace(
    {
        "linkage.kind": "rail",
        "linkage.inclination": 0.5,
        "electronics.acceleration_bandwidth": 300.0,
        "electronics.acceleration_noise": 0.0,
        "electronics.acceleration_bias": 0.0,
        "electronics.acceleration_gain_error": 0.0,
        "electronics.encoder_offset": 2e-4,
        "electronics.gauge_bias": 2.0,
        "electronics.gauge_gain_error": 0.02,
        "electronics.gauge_noise": 5.0,
        "electronics.pressure_bias": 2000.0,
    }
)
"""A bench whose sensors at the cylinder all err."""
ACROSS = np.array([-np.sin(0.5), np.cos(0.5)])


def episode(sensors, *, law="backstepping", changes=None, periods=PERIODS):
    """Idle pressures as they are and as measured, errors of the others, measured force of the hand, openings: (periods, ...).

    ``changes(errors, joint)`` may change what the episode has drawn of the sensors' errors.
    """
    env = gymnasium.make(
        "BirthSIM/Rail-v0",
        parameters=RAIL,
        sensors=sensors,
        policy_period=RAIL.electronics.control_period,
        actuation=driving(make_controller(law, RAIL), None),
    ).unwrapped
    env.reset(seed=5)
    simulation = env.simulation
    if changes:
        joint = getattr(simulation.sensors, "_joint_errors", np.zeros((JointErrors.size, 1)))
        changes(Errors(simulation.sensors._errors), JointErrors(joint))
    rows = []
    for _ in range(periods):
        simulation.run(1)
        seen = env.measurement
        pressures = simulation.plant.pressures[:, 0]
        idle, errors = (pressures[:2], seen.pressures[:2]), seen.pressures[2:] - pressures[2:]
        rows.append((*idle, errors, seen.user_force, simulation.openings[:, 0]))
    env.close()
    return [np.array(one) for one in zip(*rows, strict=True)]


def of_cylinder_1(errors, joint):
    """Other errors of every sensor that cylinder 1 would have."""
    errors.cells[:2] += 7000.0
    joint.offset[0], joint.bias[0], joint.gain[0] = 3e-3, 9.0, 0.4


def of_cylinder_2(errors, joint):
    """Likewise of cylinder 2, to which laws answer."""
    errors.cells[2:] += 7000.0


@pytest.mark.parametrize("sensors", names("sensors"))
def test_the_locked_cylinder_shows_what_is_in_it(sensors):
    true, seen, errors, force, _ = episode(sensors)
    np.testing.assert_array_equal(seen, true)
    assert np.ptp(true, axis=0).max() == 0.0
    assert (np.abs(errors).max() > 500.0) == (sensors != "ideal")
    if sensors.endswith("gauges"):  # errors of the position turn the weight; the noise of a gauge across would be 7 N
        assert np.abs(force @ ACROSS).max() < 0.5


@pytest.mark.parametrize("law", ["backstepping", "admittance", "abry"])
@pytest.mark.parametrize("sensors", [name for name in names("sensors") if name != "ideal"])
def test_no_law_answers_to_errors_of_the_locked_cylinder(sensors, law):
    openings = [episode(sensors, law=law, changes=one)[-1][:, 2:] for one in (None, of_cylinder_1, of_cylinder_2)]
    np.testing.assert_array_equal(openings[0], openings[1])
    assert np.abs(openings[0] - openings[2]).max() > 1e-3
