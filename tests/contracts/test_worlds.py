"""The environments' contract in worlds and under actions drawn at random, here, in threads and in other processes."""

import multiprocessing
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.parts.scenarios import environment_id, rig_of
from birthsim_env.registry import names

ARGUMENTS = {
    "action_mode": ("valve", "flow"), "valves": ("two_valves", "one_valve"), "sensors": ("ideal", "lab"),
    "randomize": (False, True, "plant", "scenario"), "user_force": (None, *names("hand")), "policy_period": (0.001, 0.01, 0.04),
    "duration": (None, 0.1, 3.0), "autoreset_mode": ("NextStep", "SameStep"),
}  # fmt: skip
WORLDS = st.fixed_dictionaries(
    {
        "scenario": st.sampled_from(sorted(names("scenario"))),
        "num_envs": st.integers(1, 5),
        "seed": st.integers(0, 2**63),
        "steps": st.integers(1, 60),
        "arguments": st.fixed_dictionaries({name: st.sampled_from(values) for name, values in ARGUMENTS.items()}),
    }
)


def corner(scenario, seed):
    """A rig of a scenario whose every figure that may be randomised is at one end of its range."""
    rng, law, rig = np.random.default_rng(seed), ("lugre", "coulomb")[seed % 2], rig_of(scenario, None)
    ends = {name: float(rng.choice(ends)) for name, ends in documented_ranges(rig).items()}
    return rig.replace({**ends, "friction.law": law})


def walked(world):
    """What an environment returns under random actions, checked as it comes; a rig that is not drawn is at a corner."""
    drawn = world["arguments"]["randomize"] in (True, "plant")
    arguments = {"parameters": None if drawn else corner(world["scenario"], world["seed"])}
    env = gymnasium.make_vec(environment_id(world["scenario"]), num_envs=world["num_envs"], **arguments, **world["arguments"])
    observation, info = env.reset(seed=world["seed"])
    rng, returned = np.random.default_rng(world["seed"]), [observation]
    for _ in range(world["steps"]):
        actions = rng.choice([-1.0, 1.0, 0.5, 0.0], env.action_space.shape)
        observation, rewards, terminated, truncated, info = env.step(actions)
        assert env.observation_space.contains(observation)
        assert rewards.shape == terminated.shape == truncated.shape == (world["num_envs"],)
        assert np.all((rewards >= 0) & (rewards <= max(1.0, world["arguments"].get("policy_period", 0.01) / 0.01) + 1e-9))
        assert not np.any(terminated & truncated)
        assert all(np.isfinite(info[name]).all() for name in ("position", "pressure", "temperature", "tracking_error"))
        returned += [observation, rewards, terminated, truncated, info["pressure"]]
    return returned


def assert_same(one, other):
    for here, there in zip(one, other, strict=True):
        np.testing.assert_array_equal(here, there)


@settings(max_examples=40)
@given(world=WORLDS)
def test_any_world_keeps_its_spaces_and_repeats_itself(world):
    assert_same(walked(world), walked(world))


PLAIN = [
    {
        "scenario": name,
        "num_envs": 3,
        "seed": 11,
        "steps": 30,
        "arguments": {"sensors": "lab", "randomize": True, "duration": 0.2, "user_force": "guided"},
    }
    for name in names("scenario")
]


def test_environments_in_threads_of_a_program_are_alone():
    with ThreadPoolExecutor(4) as pool:
        for here, there in zip(map(walked, PLAIN), pool.map(walked, PLAIN), strict=True):
            assert_same(here, there)


@pytest.mark.parametrize("method", ["spawn", pytest.param("forkserver", marks=pytest.mark.slow)])
def test_other_processes_see_the_same_world(method):
    context = multiprocessing.get_context(method)
    with context.Pool(1) as pool:
        there = pool.map(walked, PLAIN[:2])
    for here, other in zip(map(walked, PLAIN[:2]), there, strict=True):
        assert_same(here, other)
