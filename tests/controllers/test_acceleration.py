"""``admittance-adaptive`` on a rig with an acceleration sensor."""

import gymnasium
import numpy as np
import pytest

from baselines.bench.resting import RestingRigs
from baselines.named import make_controller
from birthsim_env.loop.signals import REFERENCES, Reference
from birthsim_env.physics.rig.parameters import load_parameters
from tests.controllers.test_admittance_adaptive import openings

RIG = load_parameters("examples/acceleration_sensor_rig.toml")


def more(acceleration):
    """What adds so much, m/s2, to the acceleration that is shown."""
    return lambda seen: {
        "acceleration": np.zeros((2, 3)) + (0.0 if seen.acceleration is None else seen.acceleration) + acceleration
    }


def adaptive(sensors="honest", believed=RIG, rig=RIG, by=0.0):
    return openings("admittance-adaptive", sensors, believed, rig, more(by))


def test_a_law_that_believes_in_no_such_sensor_does_not_read_it():
    plain = RIG.replace({"electronics.acceleration_bandwidth": 0.0})
    without = adaptive(believed=plain, rig=plain)
    np.testing.assert_array_equal(adaptive(believed=plain, by=5.0), without)
    assert (adaptive() != without).any()


def test_exact_speeds_are_not_replaced():
    np.testing.assert_array_equal(adaptive("ideal", by=5.0), adaptive("ideal"))


@pytest.mark.parametrize("name", ["admittance-adaptive", "limited:admittance-adaptive"])
def test_a_law_that_needs_an_acceleration_says_so(name):
    env = gymnasium.make("BirthSIM/Circle-v2", sensors="honest", policy_period=0.001).unwrapped
    env.reset(seed=0)
    wanted = r"measurement\.acceleration = None; allowed: \(2, 1\) m/s2, since .* electronics\.acceleration_bandwidth = 300\.0"
    with pytest.raises(ValueError, match=wanted):
        make_controller(name, RIG).command(env.measurement, env.reference)


def test_an_acceleration_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"measurement\.acceleration has shape \(3, 2, 3\); allowed: \(2, 3\)"):
        adaptive(by=np.zeros((3, 2, 3)))


def test_without_a_force_sensor_an_acceleration_tells_the_hands_force():
    def sensorless(rig, **shown):
        return openings(
            "admittance-sensorless", "honest", rig, rig, lambda seen: {n: getattr(seen, n) + v for n, v in shown.items()}
        )

    found, plain = sensorless(RIG), RIG.replace({"electronics.acceleration_bandwidth": 0.0})
    assert (found != sensorless(plain)).any()
    assert (found != sensorless(RIG, acceleration=0.5)).any()
    np.testing.assert_array_equal(sensorless(RIG, user_force=25.0), found)


@pytest.mark.slow
@pytest.mark.parametrize(("hertz", "most"), [(300.0, 2.0), (0.0, 4.0)])
@pytest.mark.parametrize("pull", [190.0, 241.0])
def test_without_a_force_sensor_a_strong_pull_is_held(hertz, most, pull):
    """At 4000 N/m; ``most`` is the error while the pull is held, mm, of which the tracker's distortion makes up to 1.5."""
    rig = RIG.replace({"electronics.acceleration_bandwidth": hertz})
    rows, lanes = np.zeros((REFERENCES, 4)), 4
    rows[:2], rows[8:10], rows[10:12] = [[0.45], [0.05]], 4000.0, [[4400.0], [2200.0]]
    law = make_controller("admittance-sensorless", rig)
    loop = RestingRigs([rig] * lanes, Reference(rows), law, "honest", seed=12)
    loop.close([])
    for k in range(5000):
        loop.pushed[0] = pull * min(max(k - 1000, 0) / 2000, 1.0)
        loop.run(1)
    assert loop.impacts.max() == 0.0
    path = loop.path(500).mean(axis=0)
    np.testing.assert_allclose(1e3 * path[0], 450.0 + pull / 4.0, atol=most)
