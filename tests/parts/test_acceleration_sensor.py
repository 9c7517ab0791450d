"""The acceleration sensor at the end effector: against a low-pass in closed form, statistics, and rigs that have none."""

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from scipy.signal import lfilter

from birthsim_env.loop.stage import Stage
from birthsim_env.parts.sensors.honest import HonestSensors
from birthsim_env.parts.sensors.ideal import IdealSensors, ideal_stage
from birthsim_env.parts.sensors.lab import LabSensors
from birthsim_env.physics.rig.parameters import Parameters
from tests.parts.test_honest_sensors import OFF, assert_uniform, board, swing, watch
from tests.registered import registered

EXACT = {**OFF, "acceleration_noise": 0.0, "acceleration_bias": 0.0, "acceleration_gain_error": 0.0}
MODELS = (LabSensors, HonestSensors)


def told(electronics, ticks, lanes=1, model=HonestSensors, motion=swing):
    """What is shown, with ``acceleration`` (ticks, 2, lanes)."""
    return watch(electronics, ticks, lanes, motion, model=model, names=("acceleration",))["acceleration"]


@pytest.mark.parametrize("model", MODELS)
def test_it_changes_nothing_else_and_a_rig_without_one_tells_none(model):
    without, has = (watch(board(acceleration_bandwidth=hertz), 300, 3, swing, model=model) for hertz in (0.0, 300.0))
    for name, values in without.items():
        np.testing.assert_array_equal(has[name], values, err_msg=name)
    home = np.array([[0.5], [0.0], [0.0], [0.0]])
    seen = model(board(), 1).measure(np.zeros(1, dtype=int), np.zeros(1), home, np.full((4, 1), 3e5), np.zeros((2, 1)))
    assert seen.acceleration is None


class Untold(IdealSensors):
    """Sampled positions, and no acceleration."""

    sampled = True

    def measure(self, *signals):
        return replace(super().measure(*signals), sampled=True)


class InTheLoop(Untold):
    def stage(self):
        return Stage(ideal_stage)


@pytest.mark.parametrize("model", [Untold, InTheLoop])
def test_own_sensors_that_tell_none_are_refused_where_the_rig_has_one(model, monkeypatch):
    registered(monkeypatch, model, sensors="own")
    gymnasium.make("BirthSIM/Circle-v2", sensors="own").reset(seed=0)
    env = gymnasium.make("BirthSIM/Circle-v2", sensors="own", parameters="examples/acceleration_sensor_rig.toml")
    with pytest.raises(ValueError, match=rf"sensors {model.__name__} tell no acceleration; allowed: \(2, 1\) m/s2, since"):
        env.reset(seed=0)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("bandwidth", [50.0, 300.0])
def test_it_feels_the_mean_of_a_period_behind_a_first_order_low_pass(model, bandwidth):
    felt = told(board(**EXACT, acceleration_bandwidth=bandwidth), 400, model=model)[:, 0, 0]
    speed = np.array([swing(1e-3 * k)[2] for k in range(400)])
    kept = math.exp(-2 * math.pi * bandwidth * 1e-3)
    np.testing.assert_allclose(felt, lfilter([1 - kept], [1, -kept], np.diff(speed, prepend=speed[0]) / 1e-3), atol=1e-9)


def test_bias_and_gain_belong_to_the_episode_and_are_uniform_up_to_their_figures():
    figures = {"acceleration_bias": 0.2, "acceleration_gain_error": 0.05}
    # Through so wide a low-pass all of a change passes.
    seen = told(board(**{**EXACT, **figures}, acceleration_bandwidth=1e5), 60, 1500)[1:]
    speed = np.array([swing(1e-3 * k)[2] for k in range(60)])
    known = np.stack([np.diff(speed) / 1e-3, np.ones(59)], axis=1)
    (gain, bias), rest = np.linalg.lstsq(known, seen[:, 0], rcond=None)[:2]
    assert rest.max() < 1e-18, "one line through all instants"
    for values, most in ((gain - 1, 0.05), (bias, 0.2), (seen[0, 1], 0.2)):
        assert_uniform(values, most)


@pytest.mark.parametrize("sensors", ["lab", "honest"])
def test_the_closed_loop_shows_what_the_model_tells(sensors):
    rig = Parameters().replace({"electronics.acceleration_bandwidth": 300.0, "electronics.acceleration_noise": 0.0})
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, sensors=sensors, policy_period=1e-3, parameters=rig)
    env.reset(seed=[3, 4])
    speed, seen = [], []
    for _ in range(60):
        info = env.step(np.full((2, 4), 0.05, np.float32))[4]
        speed.append(info["velocity"].T.copy())
        seen.append(env.measurement.acceleration)
    model = env.simulation.sensors
    share = 1 - math.exp(-0.6 * math.pi)
    mean = np.diff(speed, axis=0) / 1e-3
    if sensors == "honest":
        mean = mean * (1 + model.errors[-2:]) + model.errors[-4:-2]
    # What is told follows from what was told a period ago; in a missed period it stays.
    passes = np.array(seen[:-1]) + share * (mean - np.array(seen[:-1]))
    wrong = np.abs(passes - seen[1:]).max(axis=1) > 1e-9
    assert wrong.mean() <= (0.05 if sensors == "honest" else 0.0)
    env.close()
