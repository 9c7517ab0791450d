"""What it takes to add a controller, a scenario and a sensor, compiled into the closed loop: one file each, so many lines."""

from __future__ import annotations

import importlib.util

import gymnasium
import numpy as np
import pytest

from baselines.registry import make_controller
from birthsim_env import Parameters
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.simulation import Simulation

CONTROLLER = """
import numpy as np
from baselines.staged import LawStage, StagedController
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number

class Gain(Numbers):
    gain = number("1/m", "opening per error")

@kernel
def push(world: int, seen: Seen, memory: int, gain: Gain, tables: int, lane: int, n: int):
    for i in range(n):
        opened = max(-1.0, min(1.0, gain.gain * (seen.asked.position[0, i] - seen.position[0, i])))
        seen.opening[:2, i], seen.opening[2, i], seen.opening[3, i] = 0.0, opened, -opened
    return 0

class Pusher(StagedController):
    def law_stages(self, sampled):
        return [LawStage(push, Gain.numbers(gain=20.0), np.zeros(0))]
"""

SCENARIO = """
import gymnasium
from birthsim_env.parts.references import Path
from birthsim_env.parts.scenarios import SCENARIOS, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.parts.hands.user_forces import Ramp

def parts():
    return Path((0.48, 0.0), 0.0, 0.04, ends=2.0), Ramp(amplitude=15.0), StiffnessSchedule()

SCENARIOS["stroll"] = Scenario("A stroll of 40 mm", 3.0, parts, parts)
gymnasium.register("Mine/Stroll-v0", "birthsim_env.env:BirthSIMEnv", kwargs={"scenario": "stroll"})
"""

SENSOR = """
import numpy as np
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.sensors.sensors import SENSORS, IdealSensors
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.parts.sensors.sensors import ideal_stage

class Step(Numbers):
    step = number("m", "of the position")

@kernel
def coarse(world: World, seen: Seen, memory: int, about: Step, tables: int, lane: int, n: int):
    ideal_stage(world, seen, memory, 0, tables, lane, n)
    for axis in range(2):
        for i in range(n):
            seen.position[axis, i] = about.step * np.floor(seen.position[axis, i] / about.step + 0.5)
    return 0

class CoarseSensors(IdealSensors):
    def stage(self):
        return Stage(coarse, Step.numbers(step=1e-4))

SENSORS["coarse"] = CoarseSensors
"""


def added(tmp_path, name, source):
    path = tmp_path / f"{name}.py"
    path.write_text(source.lstrip())
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def as_before():
    """What a test adds is gone after it."""
    kept = dict(SCENARIOS), dict(SENSORS), dict(gymnasium.registry)
    yield
    for table, before in zip((SCENARIOS, SENSORS, gymnasium.registry), kept, strict=True):
        table.clear()
        table.update(before)


def lines(source):
    return len([line for line in source.splitlines() if line.strip()])


def test_a_compiled_controller_is_one_file_of_so_many_lines(tmp_path):
    added(tmp_path, "pusher", CONTROLLER)
    law = make_controller(f"{tmp_path / 'pusher.py'}:Pusher", Parameters())
    env = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=40, randomize=True, policy_period=0.001)
    env.reset(seed=0)
    for _ in range(5):
        command = law.command(env.unwrapped.measurement, env.unwrapped.reference)
        error = env.unwrapped.reference.position[0] - env.unwrapped.measurement.position[0]
        np.testing.assert_array_equal(command[2], np.clip(20.0 * error, -1, 1))
        env.step(command.T.astype(np.float32))
    assert lines(CONTROLLER) == 16


def test_a_scenario_is_one_file_of_so_many_lines(tmp_path):
    added(tmp_path, "stroll", SCENARIO)
    env = gymnasium.make("Mine/Stroll-v0")
    _, info = env.reset(seed=0)
    assert info["target"][0] == pytest.approx(0.48)
    for _ in range(220):
        _, _, _, _, info = env.step(np.zeros(4, np.float32))
    assert info["target"][0] == pytest.approx(0.52)
    assert len(env.unwrapped.simulation._loop._pieces) == 1, "all of it is compiled"
    assert lines(SCENARIO) == 9


def test_a_compiled_sensor_is_one_file_of_so_many_lines(tmp_path):
    added(tmp_path, "coarse", SENSOR)
    env = gymnasium.make("BirthSIM/Circle-v1", sensors="coarse").unwrapped
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.zeros(4, np.float32))
        seen, true = env.measurement.position, env.simulation.motion[:2, 0]
        np.testing.assert_allclose(seen, np.round(true, 4), atol=1e-12)
        assert np.abs(seen - true).max() <= 0.5001e-4
    simulation: Simulation = env.simulation
    assert len(simulation._loop._pieces) == 1, "all of it is compiled"
    assert lines(SENSOR) == 20
