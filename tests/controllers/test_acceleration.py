"""``admittance-adaptive`` on a rig with an acceleration sensor."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import load_parameters
from studies.haptics.release import measure_release

RIG = load_parameters("examples/acceleration_sensor_rig.toml")


def openings(sensors="honest", lanes=3, steps=120, believed=RIG, shown=0.0, rig=RIG):
    """Openings (steps, 4, lanes) of the law in the circle; ``shown``, m/s2, is added to the acceleration."""
    law = make_controller("admittance-adaptive", believed)
    env = gymnasium.make_vec(
        "BirthSIM/Circle-v1", num_envs=lanes, sensors=sensors, policy_period=0.001, randomize=True, parameters=rig
    )
    env.reset(seed=[40 + k for k in range(lanes)])
    told = []
    for _ in range(steps):
        seen = env.measurement
        felt = shown if seen.acceleration is None else seen.acceleration + shown
        told.append(law.command(replace(seen, acceleration=np.zeros((2, lanes)) + felt), env.reference))
        env.step(told[-1].T)
    env.close()
    return np.array(told)


def test_a_law_that_believes_in_no_such_sensor_does_not_read_it():
    plain = RIG.replace({"electronics.acceleration_bandwidth": 0.0})
    without = openings(believed=plain, rig=plain)
    np.testing.assert_array_equal(openings(believed=plain, shown=5.0), without)
    assert (openings() != without).any()


def test_exact_speeds_are_not_replaced():
    np.testing.assert_array_equal(openings("ideal", shown=5.0), openings("ideal"))


@pytest.mark.parametrize("name", ["admittance-adaptive", "limited:admittance-adaptive"])
def test_a_law_that_needs_an_acceleration_says_so(name):
    env = gymnasium.make("BirthSIM/Circle-v1", sensors="honest", policy_period=0.001).unwrapped
    env.reset(seed=0)
    wanted = r"measurement\.acceleration = None; allowed: \(2, 1\) m/s2, since .* electronics\.acceleration_bandwidth = 300\.0"
    with pytest.raises(ValueError, match=wanted):
        make_controller(name, RIG).command(env.measurement, env.reference)


def test_an_acceleration_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"measurement\.acceleration has shape \(3, 2, 3\); allowed: \(2, 3\)"):
        openings(shown=np.zeros((3, 2, 3)))


@pytest.mark.slow
def test_a_pull_that_is_let_go_overshoots_less():
    settings = {
        "controller": "admittance-adaptive",
        "source": "",
        "sensors": "honest",
        "seed": 0,
        "rigs": 3,
        "force_sensor": True,
    }
    has, plain = (
        measure_release(rig=RIG.replace({"electronics.acceleration_bandwidth": hertz}).to_dict(), **settings)
        for hertz in (300.0, 0.0)
    )
    assert np.median(has["overshoot_mm"]) < 0.5 * np.median(plain["overshoot_mm"])
    assert np.median(has["speed"]) < np.median(plain["speed"])
