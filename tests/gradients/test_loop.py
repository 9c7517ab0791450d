"""A closed loop differentiated: bits of the forward loop, gradients of what is paid against differences, refusals."""

import itertools
from typing import Any

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers the residual environments
from baselines.driving import driving
from baselines.named import make_controller
from birthsim_env.gradients.recorder import Recorder
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names
from lab.studies.gradients.checks import CONTROLLERS
from lab.studies.gradients.loops import SMOOTH, begun, compared

SCENARIO_LOOPS: dict[str, dict[str, Any]] = {
    "valves": {"world": "BirthSIM/Circle-v2"},
    "one valve, flows": {"world": "BirthSIM/Forceps-v2", "action_mode": "flow", "valves": "one_valve"},
    "no law": {"world": "BirthSIM/VacuumResidual-v1", "law": "none"},
    "residual of 5": {
        "world": "BirthSIM/DystociaResidual-v2", "law": "backstepping-force-first", "impedance": "variable",
        "sensors": "honest",
    },
    "informed": {"world": "BirthSIM/CircleResidual-v2", "law": "none", "informed": True, "sensors": "honest"},
    "a hand that feels": {"world": "BirthSIM/Probe-v3", "user_force": "guided"},
    "an accelerometer": {
        "world": "BirthSIM/Circle-v2", "controller": "admittance", "sensors": "honest",
        "parameters": SMOOTH.replace({"electronics.acceleration_bandwidth": 300.0}),
    },
}  # fmt: skip
REPEATED = {
    *("backstepping", "backstepping-weight", "backstepping-frozen", "backstepping-one-valve", "backstepping-force-first"),
    *("admittance-backstepping", "pid", "limited:admittance-adaptive"),
}
"""Laws each stage of which another loop has, with other constants. ``birthsim study gradients-checks`` has all controllers."""
LAWS = [name for name in CONTROLLERS if name not in REPEATED]
LAW_LOOPS = {
    f"{name}, {sensors}": {"world": "BirthSIM/Circle-v2", "controller": name, "sensors": sensors}
    for name, sensors in zip(LAWS, itertools.cycle(names("sensors")), strict=False)
}
LOOPS = {**SCENARIO_LOOPS, **LAW_LOOPS}
FAST = ("a hand that feels",)
OFTEN = {
    "backstepping-cartesian",
    "backstepping-integral",
    "abry",
    "admittance-sensorless",
    "sliding-mode",
    "adrc",
    "time-delay",
}
"""Laws of which a commit compiles derivatives, beside those of the scenarios' loops; the others weekly."""
WEEKLY = {"informed", *(name for name in LAW_LOOPS if name.partition(",")[0] not in {*OFTEN, "limited:pid"})}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.weekly if name in WEEKLY else () if name in FAST else pytest.mark.slow)
        for name in LOOPS
    ],
)
def test_gradients_are_differences(name: str) -> None:
    """To actions and state over four policy steps, randomised rigs: median 1e-7; what is farther off stands on kinks."""
    off, equal = compared(begun(lanes=40, **LOOPS[name]))
    assert equal
    assert off.shape[1] >= 38
    least = off.min(axis=0)
    assert np.quantile(least, 0.5) < 1e-7
    assert np.mean(least < 1e-6) >= 0.9


def lanes_of(lanes: int, **arguments: Any) -> Any:
    env: Any = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=lanes, randomize=True, **arguments).unwrapped
    env.reset(seed=5)
    return env


@pytest.mark.slow
def test_gradients_are_numbers_where_episodes_begin() -> None:
    """Memories begin with what is no number."""
    driver = driving(make_controller("limited:pid", Parameters()), None)
    carried, _ = lanes_of(3, sensors="honest", actuation=driver).simulation.vjp(np.zeros((0, 3)))(motion=np.ones((4, 3)))
    assert np.isfinite(carried).all()
    assert np.abs(carried).max() > 0.0


def test_observations_state_and_motion_have_gradients() -> None:
    """Openings drive pistons: what an observed error, the true place and a piston say of it is the same.

    Openings beyond the overlap: within it no flow follows them, and gradients are zero.
    """
    env = lanes_of(40)
    back = env.simulation.vjp(np.full((4, 40), 0.2))
    seen, motion = np.zeros(env.observation_space.shape), np.zeros((4, 40))
    seen[:, 0], motion[0] = 0.01, 1.0
    _, by_observed = back(observation=seen)
    _, by_motion = back(motion=motion)
    assert np.abs(by_motion).max() > 0
    np.testing.assert_allclose(by_observed, by_motion, rtol=1e-9, atol=1e-12 * np.abs(by_motion).max())
    state = np.zeros((18, 40))
    state[2] = 1.0
    _, by_piston = back(state=state)
    assert np.abs(by_piston).max() > 0


def test_threads_change_no_bit() -> None:
    found = []
    for threads in (1, 2):
        env = lanes_of(100, num_threads=threads)
        recorder = Recorder(env.simulation)
        env.step(np.full((100, 4), 0.2))
        found.append(recorder.taken()(reward=np.ones(100)))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)
        assert np.abs(one).max() > 0
