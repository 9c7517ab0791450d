"""Encoders and rod gauges: what they show of a moving rig, against the linkage's own equations, and each of their errors."""

import math
import warnings

import gymnasium
import numpy as np
import pytest

from birthsim_env import Parameters
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.parts.sensors.encoders import EncoderSensors
from birthsim_env.parts.sensors.joint_board import ENCODER_PARAMETERS, GAUGE_PARAMETERS, JointErrors
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS
from birthsim_env.physics.linkage.geometry import inverse_geometry, joint_force
from birthsim_env.registry import entry

CIRCLE, PROBE = "BirthSIM/Circle-v2", "BirthSIM/Probe-v3"
NONE = {f"electronics.{name}": 0.0 for name in (*SENSOR_PARAMETERS, *ENCODER_PARAMETERS, *GAUGE_PARAMETERS)}
EXACT = {**NONE, "electronics.distortion_length": 0.6}
"""No error at all."""
ACCELEROMETER = {"electronics.acceleration_bandwidth": 1e4, "electronics.acceleration_noise": 0.0}
SURE = {"electronics.acceleration_bias": 0.0, "electronics.acceleration_gain_error": 0.0}


def rig(*changes):
    return Parameters().replace({name: value for one in (EXACT, *changes) for name, value in one.items()})


def watch(sensors, parameters, periods=300, environment=CIRCLE, seed=0, **arguments):
    """Position, its time, velocity and force as measured, pistons, head and force as they are: (periods, ...) each."""
    env = gymnasium.make(environment, sensors=sensors, parameters=parameters, policy_period=0.001, **arguments).unwrapped
    env.reset(seed=seed)
    rng, rows = np.random.default_rng(1), []
    for k in range(periods):
        if k % 10 == 0:  # so long that spools leave their overlap
            action = rng.uniform(-0.4, 0.4, env.action_space.shape).astype(np.float32)
        env.step(action)
        seen, now = env.measurement, env.simulation
        true = now.plant.piston[:, 0], now.motion[:, 0], now.force[:, 0]
        rows.append((seen.position, seen.time - seen.position_time, seen.velocity, seen.user_force, *true))
    env.close()
    return [np.array(one) for one in zip(*rows, strict=True)]


def test_encoders_without_errors_show_where_the_head_is():
    position, age, velocity, force, _, motion, pushed = watch("encoders", rig())
    np.testing.assert_allclose(position, motion[:, :2], atol=1e-12)
    np.testing.assert_allclose(force, pushed, atol=1e-9)
    assert np.abs(age).max() < 1e-9
    # The shown speed is low-passed, with 5 ms.
    assert np.abs(velocity - motion[:, 2:])[20:].max() < 0.1 * np.abs(motion[:, 2:]).max()


def test_the_pistons_of_the_shown_head_are_those_that_were_counted():
    step, offset = 1e-4, 3e-4
    parameters = rig({"electronics.encoder_resolution": step, "electronics.encoder_offset": offset})
    position, _, _, _, pistons, _, _ = watch("encoders", parameters)
    counted = inverse_geometry(position.T, parameters).T
    np.testing.assert_allclose(counted / step, np.round(counted / step), atol=1e-6)
    off = counted - pistons
    assert np.ptp(off, axis=0).max() <= step * 1.0001, "the offset is that of the episode"
    assert np.abs(off).max() <= offset + step / 2 + 1e-12
    assert np.abs(off.mean(axis=0)).max() > 0.02 * offset


def test_offsets_are_uniform_up_to_their_figure_and_the_noise_has_its_size():
    electronics = rig({"electronics.encoder_offset": 5e-4, "electronics.encoder_noise": 1e-5}).electronics
    sensors = EncoderSensors(electronics, 2000)
    for lane in range(2000):
        sensors.begin(lane, np.random.default_rng(lane))
    offsets = JointErrors(sensors._joint_errors).offset / 5e-4
    assert np.abs(offsets).max() <= 1.0
    assert (offsets**2).mean() == pytest.approx(1 / 3, abs=4.5 * math.sqrt(4 / 45 / offsets.size))
    position, _, _, _, pistons, _, _ = watch("encoders", rig({"electronics.encoder_noise": 1e-5}), 1500)
    off = inverse_geometry(position.T, Parameters()).T - pistons
    assert off.std() == pytest.approx(1e-5, rel=4.5 / math.sqrt(2 * off.size))
    assert abs(np.corrcoef(off.T)[0, 1]) < 5 / math.sqrt(len(off))


@pytest.mark.parametrize(("rate", "latency"), [(1000.0, 0.003), (250.0, 0.0), (4000.0, 0.0005)])
def test_encoders_sample_at_their_rate_and_are_late(rate, latency):
    changes = {"electronics.encoder_rate": rate, "electronics.encoder_latency": latency}
    position, age, _, _, _, motion, _ = watch("encoders", rig(changes))
    period, slower = 1e-3, max(1 / rate, 1e-3)
    late = math.ceil(latency / period - 1e-9) * period
    assert age[50:].min() == pytest.approx(late, abs=1e-9)
    assert age[50:].max() == pytest.approx(late + slower - period, abs=1e-9)
    for k in range(50, len(age)):
        np.testing.assert_allclose(position[k], motion[k - round(age[k] / period), :2], atol=1e-9)


def test_on_a_soft_structure_encoders_see_the_linkage_and_a_tracker_the_handle():
    soft = rig({"mechanics.mode_frequency": 19.0, "mechanics.mode_mass_fraction": 0.4})
    position, _, _, _, pistons, motion, _ = watch("encoders", soft)
    np.testing.assert_allclose(inverse_geometry(position.T, soft).T, pistons, atol=1e-9)
    assert np.abs(position - motion[:, :2]).max() > 1e-4


FELT = {**ACCELEROMETER, **SURE}


@pytest.mark.parametrize("sensors", ["encoders-gauges", "tracker-gauges"])
def test_gauges_and_an_acceleration_sensor_feel_the_hand_a_period_ago(sensors):
    changes = {"electronics.position_rate": 1000.0, "electronics.acceleration_bandwidth": 1e5}
    _, _, _, force, _, _, pushed = watch(sensors, rig(FELT, changes), user_force="sine")
    assert np.ptp(pushed, axis=0).max() > 3.0
    # Means over a period, of a pose that has moved by less than a millimetre meanwhile.
    np.testing.assert_allclose(force[2:], pushed[1:-1], atol=0.05)


def test_without_an_acceleration_sensor_the_heads_inertia_counts_as_a_hand():
    parameters = rig()
    _, _, _, force, _, motion, pushed = watch("encoders-gauges", parameters)
    acceleration = np.diff(motion[:, 2:], axis=0) / 1e-3
    expected = pushed[1:-1] - parameters.mechanics.mass * acceleration[1:]
    np.testing.assert_allclose(force[2:], expected, atol=0.02 * np.abs(expected).max())


def test_a_gauge_does_not_feel_friction_but_a_hand_that_friction_holds():
    stiff = rig({"cylinder1.coulomb_friction": 25.0, "cylinder2.coulomb_friction": 25.0}, FELT)
    _, _, _, force, pistons, _, pushed = watch("encoders-gauges", stiff, 400, PROBE, user_force=lambda time: (8.0, 5.0))
    assert np.ptp(pistons[-100:], axis=0).max() < 0.02
    np.testing.assert_allclose(force[-100:], pushed[-100:], atol=0.05)


def test_bias_and_gain_of_gauges_act_along_the_rods():
    changes = {"electronics.gauge_bias": 5.0}
    parameters = rig(changes, FELT)
    env = gymnasium.make(PROBE, sensors="encoders-gauges", parameters=parameters, user_force=lambda time: (0.0, 0.0)).unwrapped
    env.reset(seed=3)
    bias = JointErrors(env.simulation.sensors._joint_errors).bias[:, 0]
    assert np.abs(bias).max() <= 5.0
    piston = env.simulation.plant.piston[:, 0]
    np.testing.assert_allclose(joint_force(env.measurement.user_force, piston, parameters), -bias, atol=1e-6)


@pytest.mark.parametrize("name", ["encoders", "encoders-gauges", "tracker-gauges"])
def test_what_is_drawn_are_the_sensors_that_there_are(name):
    drawn = set(entry("sensors", name).made.drawn)
    assert ("electronics.position_noise" in drawn) == name.startswith("tracker")
    assert ("electronics.encoder_offset" in drawn) == name.startswith("encoders")
    assert ("electronics.gauge_bias" in drawn) == name.endswith("gauges")
    assert ("electronics.force_bias" in drawn) == (name == "encoders")
    assert drawn <= set(documented_ranges(Parameters(), name)) | {"electronics.clock_jitter"}
    assert not any("encoder" in one or "gauge" in one for one in documented_ranges(Parameters(), "honest"))
    env = gymnasium.make_vec(CIRCLE, num_envs=3, sensors=name, randomize="sensors")
    env.reset(seed=0)
    figures = env.unwrapped.simulation.sensors.parameters
    for one in drawn - {"electronics.clock_jitter"}:
        low, high = documented_ranges(Parameters(), name)[one]
        values = figures[one.removeprefix("electronics.")]
        assert ((low <= values) & (values <= high)).all()
        assert np.ptp(values) > 0
    env.close()


@pytest.mark.parametrize("name", ["encoders-gauges", "tracker-gauges"])
def test_gauges_without_an_acceleration_sensor_warn_and_say_what_they_need(name):
    made = entry("sensors", name)
    with pytest.warns(UserWarning, match=r"electronics\.acceleration_bandwidth = 0: .*; give the rig one, such as 300 Hz"):
        made.made(Parameters().electronics, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.made(rig(ACCELEROMETER).electronics, 1)
    assert made.needs == {"acceleration sensor"}
