"""Kinds of odd values, given to whatever takes them: keys that are no text, more entries than memory, names that are none."""

import math
from pathlib import Path
from types import MappingProxyType

import gymnasium
import numpy as np
import pytest

import birthsim
from agents.policy.files import read_policy
from agents.policy.seeds import policy_folders
from agents.training.configuration import load_configuration
from baselines import make_controller
from birthsim_env import Parameters, Plant, linearize, normalized_return
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.physics.rig.values import length_of
from birthsim_env.vector_env import BirthSIMVectorEnv
from tests.fuzz.watched import watched

CIRCLE = "BirthSIM/Circle-v2"
RIG = Parameters()


def circle(**arguments):
    return BirthSIMVectorEnv("circle", **{"num_envs": 2, **arguments})


def refused(call, value, *names):
    """The refusal of a value, which says one of ``names`` and what is allowed, and takes neither memory nor time."""
    with watched(*names, runs_code=True, memory=2**30) as example:
        call(value)
    return example.refused


KEYS = (1, None, 1.5, True, b"mass", (1, 2), frozenset(), 10**5000, "", ".", "x\ny", "x" * 5000)
MAPPINGS = {
    "a section": lambda key: {key: {"mass": 4.0}},
    "an empty section": lambda key: {key: {}},
    "a value": lambda key: {key: 4.0},
    "a field": lambda key: {"mechanics": {key: 4.0}},
    "a range": lambda key: {"randomize": {key: [2.0, 5.0]}},
    "a wrong range": lambda key: {"randomize": {key: 2.0}},
}
RIGS = {
    "from_dict": Parameters.from_dict,
    "load_parameters": load_parameters,
    "Plant": Plant,
    "parameters": lambda given: circle(parameters=given),
    "controller": lambda given: make_controller("pid", given),
}


@pytest.mark.parametrize("kind", MAPPINGS)
@pytest.mark.parametrize("name", RIGS)
def test_a_key_of_a_rig_that_names_nothing_is_refused(name, kind):
    for key in KEYS:
        assert refused(RIGS[name], MAPPINGS[kind](key), "parameter", "a section", "[randomize]")


@pytest.mark.parametrize("key", KEYS, ids=range(len(KEYS)))
def test_a_key_of_another_mapping_that_names_nothing_is_refused(key):
    env = circle()
    assert refused(RIG.replace, {key: 4.0}, "parameter")
    assert refused(lambda given: circle(randomize=given), {key: (2.0, 5.0)}, "randomize", "parameter")
    assert refused(lambda given: env.reset(seed=0, options=given), {key: 1}, "options")
    env.reset(seed=0)
    assert refused(env.set_state, {key: np.zeros(2)}, "state")


def test_any_mapping_is_one_of_a_rig_and_nothing_else():
    given = MappingProxyType({"mechanics": MappingProxyType({"mass": 4.0})})
    assert Parameters.from_dict(given) == load_parameters(given) == RIG.replace({"mechanics.mass": 4.0})
    for wrong in (3, None, [], "mechanics"):
        assert refused(Parameters.from_dict, wrong, "sections")


ENTRIES = (range(10**12), range(10**30), (range(10**12),) * 2, [[range(10**12)]], np.broadcast_to(1.0, 10**10))
SEQUENCES = {
    "seed": lambda given: circle().reset(seed=given),
    "reset_mask": lambda given: circle().reset(seed=0, options={"reset_mask": given}),
    "position": lambda given: circle().reset(seed=0, options={"position": given}),
    "picture_size": lambda given: circle(picture_size=given),
    "parameters": lambda given: Plant(given, 2),
    "state": lambda given: setattr(Plant(num_envs=2), "state", given),
    "opening_command": lambda given: Plant(num_envs=2).advance(given, np.zeros((2, 2)), 0.01),
    "user_force": lambda given: Plant(num_envs=2).advance(np.zeros((4, 2)), given, 0.01),
    "pose": lambda given: linearize(None, given),
}
LONG = {
    "frequency": lambda given: linearize(None, (0.5, 0.0)).frequency_response(given),
    "total": lambda given: normalized_return(CIRCLE, given),
}


@pytest.mark.parametrize("name", SEQUENCES | LONG)
def test_more_entries_than_memory_are_refused_before_they_are_listed(name):
    for value in ENTRIES[:4] if name in LONG else ENTRIES:
        assert refused((SEQUENCES | LONG)[name], value, name)


def test_entries_are_counted_without_being_listed():
    assert length_of([1, 2]) == 2
    assert length_of(range(10**12)) == 10**12
    assert length_of(range(10**30)) == math.inf


@pytest.mark.parametrize("make", [lambda: [[]], lambda: ["x" * 5000]])
def test_what_nests_or_is_long_is_refused_in_a_short_line(make):
    value = make()
    for _ in range(3000 if value == [[]] else 0):
        value = [value]
    for name in ("parameters", "picture_size", "reset_mask", "seed"):
        assert refused(SEQUENCES[name], value, name)


NAMES = ("x" * 5000, "a/" * 3000, "x" * 300, "a\x00b", "")
FILES = {
    "parameters": (Parameters.from_toml, load_parameters, Plant),
    "configuration": (load_configuration, lambda name: load_configuration(f"{name}.toml")),
    "policy": (read_policy, policy_folders, lambda name: make_controller(f"residual:{name}")),
    "controller": (make_controller, lambda name: make_controller(f"{name}.py:Own")),
    "reference": (
        *(lambda name, ending=ending: circle(reference=f"{name}{ending}") for ending in (".csv", ".py:Own")),
    ),
    "user_force": (lambda name: circle(user_force=f"{name}.csv"),),
    "log": (lambda name: birthsim.identify(name, RIG), lambda name: birthsim.compare(name, RIG)),
    "out": (lambda name: birthsim.export("fmu", out=f"{name}.txt"),),
    "environment": (birthsim.make,),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_a_name_that_no_system_takes_is_no_file(name):
    for call in FILES[name]:
        for text in NAMES:
            assert refused(call, text, name, f"--{name}")


def test_a_path_to_export_to_may_be_text(tmp_path):
    assert birthsim.export("fmu", out=str(tmp_path / "rig.fmu")) == tmp_path / "rig.fmu"
    assert Path(tmp_path / "rig.fmu").is_file()
    assert refused(lambda out: birthsim.export("fmu", out=out), 3, "out")


def test_an_environment_has_a_name():
    for wrong in (np.zeros(3), [], 3, None):
        assert refused(birthsim.make, wrong, "environment")
        assert refused(lambda given: birthsim.make_vec(given, 2), wrong, "environment")
    assert gymnasium.spec(CIRCLE).id == CIRCLE
