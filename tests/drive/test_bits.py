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
