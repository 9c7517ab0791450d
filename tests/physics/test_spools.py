"""Valves that do not open as they are told, against the stop operator and the second model."""

import gymnasium
import numpy as np
import pytest

from birthsim_env.physics.compiled.lanes import PLAY, parameter_array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.pneumatics import spools
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.accuracy.motions import PERIOD, PERIODS, strong
from tests.physics.test_second_model import start

CIRCLE = "BirthSIM/Circle-v2"
WORN = {"valves.hysteresis": 0.08, "valves.opening_limit": 0.7}


class OtherSpool:
    """Play as what the stop operator leaves: a spring of +-half the width between the command and what follows it."""

    def __init__(self, width, limit, valves=4):
        self.half, self.limit = width / 2, limit
        self.command, self.spring = np.zeros(valves), np.zeros(valves)

    def __call__(self, command):
        self.spring = np.clip(self.spring + (command - self.command), -self.half, self.half)
        self.command = np.array(command)
        return np.clip(self.command - self.spring, -self.limit, self.limit)


@pytest.mark.parametrize("worn", [(0.0, 1.0), (0.1, 1.0), (0.0, 0.5), (0.04, 0.7)])
def test_openings_are_those_of_the_stop_operator_within_the_stroke(worn):
    rig = Parameters().replace(dict(zip(WORN, worn, strict=True)))
    parameters, rng = parameter_array(rig, 3), np.random.default_rng(0)
    last, opening, other = np.zeros((4, 3)), np.empty((4, 3)), OtherSpool(*worn, valves=(4, 3))
    path = np.clip(np.cumsum(rng.normal(0, 0.05, (400, 4, 3)), axis=0), -1, 1)
    for command in path:
        spools.admit_lanes(command, parameters, last, opening)
        np.testing.assert_allclose(opening, other(command), atol=1e-9)
        if worn == (0.0, 1.0):
            np.testing.assert_array_equal(opening, command)
    assert spools.are_perfect(parameters) == (worn == (0.0, 1.0))


def test_a_worn_plant_moves_as_the_second_model_behind_another_spool():
    rig = Parameters().replace(WORN)
    plant, (perfect, model), spool = Plant(rig), start(Parameters()), OtherSpool(*WORN.values())
    plant.state[:] = perfect.state
    for k in range(PERIODS):
        command, push = strong(k)
        model.advance(spool(command), push, PERIOD)
        plant.advance(command[:, None], push[:, None], PERIOD)
        perfect.advance(command[:, None], push[:, None], PERIOD)
        np.testing.assert_allclose(plant.end_effector()[:2, 0], model.state[:2], atol=2e-5)
        np.testing.assert_allclose(plant.pressures[:, 0], model.pressures, rtol=2e-3)
    assert np.abs(plant.end_effector() - perfect.end_effector())[:2].max() > 1e-3, "it matters"


def run(lanes, seed, **setting):
    env = gymnasium.make_vec(CIRCLE, num_envs=lanes, **setting)
    found, rng = [env.reset(seed=seed)[0]], np.random.default_rng(0)
    for _ in range(40):
        action = rng.uniform(-0.2, 0.2, 4).astype(np.float32)
        found.append(env.step(np.tile(action, (lanes, 1)))[0])
    return np.array(found)


def test_a_perfect_lane_among_worn_ones_has_the_bits_of_a_perfect_rig():
    ranges = {"valves.hysteresis": (0.0, 0.0), "valves.opening_limit": (1.0, 1.0)}
    np.testing.assert_array_equal(run(2, 3, randomize=ranges), run(2, 3))
    env = gymnasium.make_vec(CIRCLE, num_envs=2)
    env.reset(seed=3)
    env.unwrapped.simulation.plant.lane_parameters[PLAY, 1] = 0.05
    env.unwrapped.simulation.forget_loops()
    rng = np.random.default_rng(0)
    for _ in range(40):
        observation = env.step(np.tile(rng.uniform(-0.2, 0.2, 4).astype(np.float32), (2, 1)))[0]
    np.testing.assert_array_equal(observation[0], run(2, 3)[-1, 0])
    assert not np.array_equal(observation[1], run(2, 3)[-1, 1])
