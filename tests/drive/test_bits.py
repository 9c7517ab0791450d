"""A rig behind a socket moves as one in Python's own loop, bit for bit."""

import gymnasium
import numpy as np
import pytest

from baselines.driving import NO_ACTION, driving
from baselines.named import make_controller
from birthsim_drive.loop.control import COURSE
from birthsim_drive.loop.record import Period
from birthsim_drive.simulated import Simulated
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.rig.parameters import Parameters
from tests.drive.rigs import PROBE, RIG, drive

RAIL = Parameters.from_dict({"linkage": {"kind": "rail"}})


@pytest.mark.parametrize(
    ("controller", "environment", "rig", "sensors"),
    [
        ("limited:admittance-adaptive", PROBE, RIG, "lab"),
        ("limited:backstepping", "BirthSIM/Circle-v2", RIG, "ideal"),
        ("limited:admittance", "BirthSIM/Rail-v0", RAIL, "encoders"),
    ],
)
def test_a_driven_rig_moves_as_in_pythons_own_loop(tmp_path, controller, environment, rig, sensors):
    period = rig.electronics.control_period
    simulated = Simulated(environment, rig, sensors, seed=3, lockstep=True)
    options = {"rig": rig, "controller": controller, "environment": environment, "seed": 3, "duration": 0.8}
    loop, record, _ = drive(tmp_path, simulated, **options)
    assert loop.faults == []
    env = gymnasium.make(
        environment,
        parameters=rig,
        policy_period=period,
        sensors=sensors,
        actuation=driving(make_controller(controller, rig), None),
    )
    env.reset(seed=3)
    rows = record.kept
    signals = Signals(rows[Period.signals.place])
    course = rows[Period.phase.first] == COURSE
    assert course.sum() == 800
    for k in np.flatnonzero(course):
        seen, asked = env.unwrapped.measurement, env.unwrapped.reference
        assert signals.pressure[:, k].tolist() == seen.pressures.tolist(), k
        assert signals.position[:, k].tolist() == seen.position.tolist(), k
        assert signals.user_force[:, k].tolist() == seen.user_force.tolist(), k
        assert signals.reference.rows[:, k].tolist() == asked.rows.tolist(), k
        env.step(NO_ACTION)
        simulation = env.unwrapped.simulation
        if not simulation.sensors.has_board:  # which rounds what it puts out
            assert rows[Period.opening.place][:, k].tolist() == simulation.openings[:, 0].tolist(), k
    env.close()


class WithoutCylinder1:
    """A driver of a rail that has nothing to say of the cylinder that is not there."""

    def __init__(self, driver):
        self._driver = driver

    def __getattr__(self, name):
        return getattr(self._driver, name)

    def read(self):
        seen = self._driver.read()
        seen.pressures[:2] = np.nan
        return seen


def test_a_rails_driver_may_say_nothing_of_the_cylinder_that_it_lacks(tmp_path):
    def openings(name, **options):
        (tmp_path / name).mkdir()
        simulated = Simulated("BirthSIM/Rail-v0", RAIL, "encoders", seed=3, lockstep=True)
        told = {"rig": RAIL, "controller": "admittance", "environment": "BirthSIM/Rail-v0", "seed": 3, "duration": 0.2}
        loop, record, _ = drive(tmp_path / name, simulated, **told, **options)
        assert loop.faults == []
        return record.kept[Period.opening.place]

    whole, lacking = openings("whole"), openings("lacking", wrap=WithoutCylinder1)
    assert np.ptp(whole[2:], axis=1).min() > 0.01
    np.testing.assert_array_equal(whole, lacking)
