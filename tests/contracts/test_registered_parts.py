"""Every registered sensor model, hand and scenario keeps the protocol of its kind, and is the same in Python and compiled."""

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers ids with a controller inside
from birthsim_env import Parameters, StiffnessSchedule, Trajectory, UserForce
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.drawn.randomization import checked_ranges, documented_ranges
from birthsim_env.parts.scenarios import Scenario, environment_id, find_scenario
from birthsim_env.parts.sensors.model import SensorModel
from birthsim_env.registry import entries, entry
from tests.registered import registered

CIRCLE = "BirthSIM/Circle-v2"
FELT = Parameters().replace({"electronics.acceleration_bandwidth": 300.0})
TUBED = Parameters().replace({"chambers.tube_length": 1.0, "chambers.pressure_cells": "valve"})


def each(kind):
    return pytest.mark.parametrize("one", entries(kind), ids=lambda one: one.name)


@pytest.mark.parametrize("kind", ["sensors", "hand", "scenario"])
def test_all_say_what_they_are_in_a_sentence(kind):
    assert [one.name for one in entries(kind) if not one.about.endswith(".") or "\n" in one.about] == []


@each("sensors")
def test_a_sensor_model_draws_parameters_that_may_be_drawn(one):
    assert issubclass(one.made, SensorModel)
    ranges = documented_ranges(Parameters(), one.name)
    drawn = {name: ranges[name] for name in one.made.drawn if name in ranges}
    checked_ranges(drawn, Parameters(), one.name)
    if drawn:
        one.made(Parameters().electronics, 2).vary(drawn)


def in_python(base, *methods):
    """A class whose ``methods`` are those of its base and are called, since they are its own."""

    def calling(method):
        def called(self, *given):
            return getattr(base, method)(self, *given)

        return called

    return type(f"Own{base.__name__}", (base,), {method: calling(method) for method in methods})


def course(**arguments):
    """Observations and states of three lanes over 30 policy steps."""
    env = gymnasium.make_vec(CIRCLE, num_envs=3, **arguments).unwrapped
    rows = [env.reset(seed=3)[0]]
    for action in np.random.default_rng(0).uniform(-0.3, 0.3, (30, 3, 4)):
        rows.append(env.step(action)[0])
    return np.array(rows), env.simulation.plant.state.copy(), env.simulation.rows()[1]


def assert_same(one, other):
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


@each("sensors")
@pytest.mark.parametrize(
    "parameters",
    [Parameters(), FELT, TUBED],
    ids=["plain", "with an acceleration sensor", "with tubes and cells at the valves"],
)
def test_a_sensor_model_measures_the_same_in_python_and_compiled(one, parameters, monkeypatch):
    board = ("put_out",) if one.made(parameters.electronics, 1).has_board else ()
    registered(monkeypatch, in_python(one.made, "measure", *board), sensors="own")
    world = {"parameters": parameters, "randomize": "plant", "user_force": "sine"}
    assert_same(*(course(sensors=name, **world) for name in (one.name, "own")))


@each("hand")
@pytest.mark.parametrize("randomize", [False, "scenario"])
def test_a_hand_pushes_the_same_in_python_and_compiled(one, randomize, monkeypatch):
    for made in (one.made(), one.made.varied()):
        assert isinstance(made, UserForce)
    registered(monkeypatch, in_python(one.made, "force"), hand="own")
    assert_same(*(course(user_force=name, randomize=randomize) for name in (one.name, "own")))


@each("scenario")
def test_a_scenario_has_parts_a_title_and_ids(one):
    scenario = find_scenario(one.name)
    assert isinstance(scenario, Scenario)
    assert scenario.title
    assert scenario.experiment
    assert scenario.duration > 0.0
    for parts in (scenario.nominal(), scenario.varied()):
        assert all(isinstance(part, kind) for part, kind in zip(parts, (Trajectory, UserForce, StiffnessSchedule), strict=True))
    for kind in ("", "Residual"):
        assert environment_id(one.name, kind) in gymnasium.registry


class Nothing(SensorModel):
    pass


class Mute(SensorModel):
    drawn = ("electronics.force_bias",)

    def stage(self):
        return entry("sensors", "ideal").made.stage(self)


def test_what_a_sensor_model_lacks_is_named(monkeypatch):
    registered(monkeypatch, Nothing, sensors="nothing")
    with pytest.raises(NotImplementedError, match=r"Nothing has neither measure\(.*\) nor stage\(\)"):
        gymnasium.make(CIRCLE, sensors="nothing").reset()
    registered(monkeypatch, Mute, sensors="mute")
    assert isinstance(Mute(Parameters().electronics, 1).stage(), Stage)
    with pytest.raises(NotImplementedError, match=r"Mute\.vary\(ranges\) is missing; it draws electronics\.force_bias"):
        gymnasium.make(CIRCLE, sensors="mute", randomize="sensors")
