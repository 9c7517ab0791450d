"""``honest`` sensors in the closed loop: lanes, threads, stops for Python, the valves' converter, and what is drawn."""

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers the residual environments
from baselines import make_controller
from birthsim_env import FixedTarget, ForceProfile, Parameters, StiffnessSchedule
from birthsim_env.parts.drawn.randomization import described, documented_ranges
from birthsim_env.parts.sensors.honest import HonestSensors
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS
from lab.studies.haptics.worlds import no_hand, resting
from lab.studies.stability.rig_port import RigPort
from tests.env.test_loop import OwnValves, assert_same, course, own
from tests.parts.test_honest_sensors import OFF
from tests.registered import registered

CIRCLE = "BirthSIM/Circle-v2"


class AskedForAll(HonestSensors):
    """Sensors whose measurements and control board are asked in Python."""

    def measure(self, *seen):
        return super().measure(*seen)

    def put_out(self, *commanded):
        return super().put_out(*commanded)


@pytest.mark.parametrize("part", [own(HonestSensors, "measure"), AskedForAll, "actuation"])
def test_a_stop_for_python_changes_no_bit(part, monkeypatch):
    registered(monkeypatch, HonestSensors if part == "actuation" else part, sensors="own")
    rig = Parameters().replace({"electronics.missed_periods": 0.2})
    setting = {"num_envs": 3, "parameters": rig, "randomize": True}
    changes = {"sensors": "own"} if part != "actuation" else {"actuation": OwnValves("two_valves"), "sensors": "honest"}
    one, other = (gymnasium.make_vec(CIRCLE, **{**setting, **more}) for more in ({"sensors": "honest"}, changes))
    assert_same(course(one), course(other))


def test_valves_are_commanded_in_steps_and_stay_in_missed_periods():
    rig = Parameters().replace({"electronics.dac_bits": 6.0, "electronics.missed_periods": 0.3})
    env = gymnasium.make_vec(CIRCLE, num_envs=20, sensors="honest", parameters=rig, policy_period=0.001)
    env.reset(seed=0)
    rng, told, wanted = np.random.default_rng(1), [], []
    for _ in range(200):
        action = rng.uniform(-1, 1, (20, 4)).astype(np.float32)
        env.step(action)
        told.append(env.unwrapped.simulation.openings)
        wanted.append(action.T)
    told = np.array(told)
    np.testing.assert_array_equal(told * 32, np.round(told * 32))
    fresh = np.abs(told - np.array(wanted)).max(axis=1) <= 1 / 64 + 1e-12
    held = np.concatenate([np.zeros((1, 20), bool), (told[1:] == told[:-1]).all(axis=1)])
    assert np.all(fresh | held)
    assert fresh[0].all(), "the first period is never missed"
    missed = ~fresh
    assert missed.mean() == pytest.approx(0.3, abs=4.5 * np.sqrt(0.21 / missed.size))


def test_a_rig_held_at_its_port_has_the_control_board_of_its_sensors():
    """Nobody holds it: the rig of the bench and the environment's are one, to the last bit."""
    rig = Parameters().replace({"electronics.dac_bits": 8.0, "electronics.missed_periods": 0.2})
    law, reference = make_controller("backstepping", rig), resting([(0.5, 0.0)] * 2, [2000.0] * 2)
    port = RigPort([rig] * 2, reference, law, "honest", seed=5)
    pneumatic1, pneumatic2 = ((value,) for value in reference.pneumatic_stiffness[:, 0])
    parts = {
        "reference": FixedTarget(),
        "user_force": ForceProfile(),
        "stiffness": StiffnessSchedule(pneumatic1=pneumatic1, pneumatic2=pneumatic2),
    }
    env = gymnasium.make_vec(CIRCLE, num_envs=2, sensors="honest", parameters=rig, policy_period=0.001, **parts)
    env.reset(seed=5)
    simulation, same_law = env.unwrapped.simulation, make_controller("backstepping", rig)
    for _ in range(200):
        simulation.step(same_law.command(simulation.measurement, simulation.reference))
        port.advance(no_hand)
        np.testing.assert_array_equal(simulation.motion, port.motion())


def test_a_clock_that_jitters_puts_out_the_mean_of_both_openings_over_the_period():
    rig = Parameters().replace({f"electronics.{name}": value for name, value in {**OFF, "clock_jitter": 0.4}.items()})
    env = gymnasium.make_vec(CIRCLE, num_envs=20, sensors="honest", parameters=rig, policy_period=0.001)
    env.reset(seed=0)
    rng, before, late = np.random.default_rng(1), np.zeros((4, 20)), []
    for _ in range(300):
        action = rng.uniform(-1, 1, (20, 4)).astype(np.float32)
        env.step(action)
        late.append((env.unwrapped.simulation.openings - action.T) / (before - action.T))
        before = action.T.astype(float)
    late = np.array(late)
    assert not late[0].any(), "the first period is on time"
    late = late[1:]
    np.testing.assert_allclose(late, np.broadcast_to(late[:, :1], late.shape), atol=1e-9)
    fractions = late[:, 0].ravel()
    assert fractions.min() >= -1e-12
    assert fractions.max() <= 0.4 + 1e-12
    # Kolmogorov's bound at one in a thousand.
    apart = np.abs(np.sort(fractions) / 0.4 - (np.arange(fractions.size) + 0.5) / fractions.size).max()
    assert apart < 1.95 / np.sqrt(fractions.size)


def test_what_sensors_draw_changes_no_rig_and_follows_the_seed():
    envs = {kind: gymnasium.make_vec(CIRCLE, num_envs=50, sensors=kind, randomize=True) for kind in ("ideal", "lab", "honest")}
    for env in envs.values():
        env.reset(seed=5)
    rigs = [env.unwrapped.simulation.plant.lane_parameters for env in envs.values()]
    assert_same(rigs[1:], rigs[:1] * 2)
    drawn = envs["honest"].unwrapped.simulation.sensors._errors[: len(SENSOR_PARAMETERS)].copy()
    ranges = documented_ranges(Parameters(), "honest")
    assert {f"electronics.{name}" for name in SENSOR_PARAMETERS} - set(ranges) == {"electronics.clock_jitter"}, "an option"
    for row, name in zip(drawn, SENSOR_PARAMETERS[:-1], strict=False):
        low, high = ranges[f"electronics.{name}"]
        assert low <= row.min() < low + 0.2 * (high - low) < high - 0.2 * (high - low) < row.max() <= high, name
    envs["honest"].reset(seed=6)
    again = envs["honest"].unwrapped.simulation.sensors._errors[: len(SENSOR_PARAMETERS)]
    np.testing.assert_array_equal(again[:, :-1], drawn[:, 1:])


def test_drawn_sensors_meet_the_nominal_rig_and_have_the_errors_of_rigs_and_sensors_drawn():
    envs = {
        what: gymnasium.make_vec(CIRCLE, num_envs=4, sensors="honest", randomize=what) for what in ("sensors", "scenario", True)
    }
    for env in envs.values():
        env.reset(seed=5)
    sensors, scenario, both = (env.unwrapped.simulation for env in envs.values())
    np.testing.assert_array_equal(sensors.plant.lane_parameters, scenario.plant.lane_parameters)
    np.testing.assert_array_equal(sensors.reference.rows, scenario.reference.rows)
    np.testing.assert_array_equal(sensors.sensors._errors, both.sensors._errors)
    assert not np.array_equal(sensors.sensors._errors, scenario.sensors._errors)
    believed = envs["sensors"].unwrapped.simulation.parameters.electronics
    assert believed == Parameters().electronics, "what a law is given"
    assert described(Parameters(), "sensors", "honest").startswith("sensors drawn: position noise 5e-05 to 0.0003 m, ")


def test_a_laboratorys_own_figures_and_ranges_come_from_its_file(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('[electronics]\nforce_noise = 0.0\nforce_bias = 3.0\n[randomize]\n"electronics.adc_bits" = [9, 10]\n')
    rig = Parameters.from_toml(path)
    ranges = documented_ranges(rig, "honest")
    assert ranges["electronics.force_noise"] == (0.0, 0.0), "what is switched off stays off"
    assert ranges["electronics.force_bias"] == pytest.approx((2.4, 3.6))
    assert ranges["electronics.adc_bits"] == (9, 10)
    assert "electronics.adc_bits" not in documented_ranges(rig, "lab")
    for kind in ("honest", "lab"):
        gymnasium.make(CIRCLE, sensors=kind, parameters=path, randomize=True).reset(seed=0)
    rig.to_toml(path)
    assert Parameters.from_toml(path) == rig == Parameters.from_dict(rig.to_dict())
    assert "pressure_range" in path.read_text(), "a file names every figure"
    assert rig.to_dict()["electronics"].keys() >= {"force_noise", "force_bias", "position_noise"}
    assert "pressure_range" not in rig.to_dict()["electronics"]
