"""Calls with odd arguments: environments, actions, parts, controllers, parameters and settings. What was accepted works."""

import dataclasses
import inspect
from functools import cache

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.residual.env import ResidualEnv
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings
from baselines.named import known_options, make_controller
from birthsim_env import Parameters, Plant, StiffnessSchedule, Trajectory, UserForce
from birthsim_env.env import BirthSIMEnv
from birthsim_env.registry import names
from birthsim_env.vector_env import BirthSIMVectorEnv
from tests.fuzz.rigs import run_a_little
from tests.fuzz.strategies import composite, near, sampled, strange
from tests.fuzz.watched import cases, watched

STEPS, CALLING = 4, 2**30
CIRCLE, RIG = "BirthSIM/Circle-v2", Parameters()

GOOD = {
    "action_mode": ("valve", "flow"),
    "valves": ("two_valves", "one_valve"),
    "sensors": tuple(names("sensors")),
    "randomize": (False, True, "plant", "scenario", "sensors", {"mechanics.mass": (2, 5)}),
    "reference": (None,),
    "user_force": (None, *names("hand")),
    "stiffness": (None,),
    "parameters": (None,),
    "policy_period": (0.01, 0.002, 0.1),
    "duration": (None, 0.5, 30.0),
    "actuation": (None,),
    "picture_size": ((640, 480), (64, 64)),
    "num_threads": (None, 1, 2),
    "render_mode": (None, "rgb_array"),
}
VECTOR = {"num_envs": (1, 3), "max_episode_steps": (None, 3), "autoreset_mode": ("NextStep", "SameStep", "Disabled")}
RESET = {"seed": (0, None), "position": ((0.5, 0.0),)}
LANES = {"reset_mask": (None,), "staggered": (True, False)}


@composite
def arguments(draw, table):
    """Some arguments of a table, one of which is odd more often than not."""
    chosen = draw(st.lists(sampled(list(table)), unique=True, max_size=4))
    given = {name: draw(sampled(table[name])) for name in chosen}
    if chosen and draw(st.integers(0, 2)):
        odd, usual = chosen[0], table[chosen[0]][0]
        given[odd] = draw(strange | near(usual) if isinstance(usual, float) else strange)
    return given


@cache
def compiled():
    """Loops of other options are compiled before time and memory count."""
    modes = (("valve", "two_valves"), ("flow", "one_valve"), ("flow", "two_valves"), ("valve", "one_valve"))
    for k, sensors in enumerate(names("sensors")):
        for (mode, valves), hand in zip(modes, names("hand"), strict=False):
            env = BirthSIMVectorEnv("circle", num_envs=2, action_mode=mode, valves=valves, sensors=sensors, user_force=hand)
            env.reset(seed=k, options={"staggered": True})
            env.step(np.zeros(env.action_space.shape))


@pytest.mark.parametrize("vector", [False, True])
@cases
@given(data=st.data())
def test_an_environment(vector, data):
    compiled()
    how = data.draw(arguments(GOOD | VECTOR if vector else GOOD))
    begin = data.draw(arguments(RESET | LANES if vector else RESET))
    rng = np.random.default_rng(0)
    with watched(*how, *begin, "reference", "Mechanics", "action", "parameter", runs_code=True, memory=CALLING):
        env = (BirthSIMVectorEnv if vector else BirthSIMEnv)("circle", **how)
        seed = begin.pop("seed", None)
        try:
            observation, info = env.reset(seed=seed, options=begin or None)
        except gymnasium.error.Error:
            return  # Gymnasium's own refusal of a seed
        for _ in range(STEPS):
            assert env.observation_space.contains(observation)
            if getattr(env, "_ended", np.zeros(1)).any() and how.get("autoreset_mode") == "Disabled":
                break
            observation, reward, *_, info = env.step(rng.uniform(-1, 1, env.action_space.shape))
            assert np.isfinite(reward).all()
            assert np.isfinite(env.simulation.plant.state).all()
        assert np.isfinite(info["position"]).all()


@cache
def begun(lanes):
    env = gymnasium.make(CIRCLE) if lanes == 0 else gymnasium.make_vec(CIRCLE, num_envs=lanes)
    env.reset(seed=0)
    return env


@pytest.mark.parametrize("lanes", [0, 2])
@cases
@given(data=st.data())
def test_an_action(lanes, data):
    env = begun(lanes)
    action = data.draw(strange)
    if data.draw(st.booleans()):
        entries = np.zeros(env.action_space.shape).tolist()
        (entries if lanes == 0 else entries[0])[data.draw(st.integers(0, 3))] = action
        action = entries
    env.reset(seed=0)
    with watched("action"):
        env.step(action)


REQUIRED = {"sizes": (100.0,), "rate": 70.0, "scenario": "probe", "parameters": RIG}
ROLES = {Trajectory: "reference", UserForce: "user_force", StiffnessSchedule: "stiffness"}
"""What a part is in an environment."""


def options_of(make):
    """Name -> default of what a class takes."""
    known = inspect.signature(make).parameters.values()
    return {one.name: one.default for one in known if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)}


def parts(role):
    """The classes of a role that a user makes with options, whatever file they stand in."""
    for kind in role.__subclasses__():
        yield from parts(kind)
    options = options_of(role)
    lacks = [name for name, default in options.items() if default is inspect.Parameter.empty and name not in REQUIRED]
    if options and not lacks and not role.__name__.startswith("_"):
        yield role


MADE = {
    **{one.__name__: one for role in ROLES for one in parts(role) if one.__module__.startswith("birthsim_env")},
    **{one.__name__: one for one in (Plant, ResidualEnv, ResidualSettings, TrainingSettings)},
}


@composite
def odd_options(draw, options):
    """One or two options of all, odd or in the neighbourhood of what they are; now and then one that there is not."""
    chosen = draw(st.lists(sampled(sorted(options) or ["unknown"]), unique=True, min_size=1, max_size=2))
    if draw(st.integers(0, 19)) == 0:
        chosen.append("unknown")
    usual = {name: options.get(name) for name in chosen}
    return {name: draw(strange | near(one) if isinstance(one, float) else strange) for name, one in usual.items()}


def use(made):
    """A few steps with what was made: nothing that was accepted fails later."""
    own = {role: made for kind, role in ROLES.items() if isinstance(made, kind)}
    command = getattr(made, "command", None)
    if own or command:
        env = BirthSIMVectorEnv("circle", num_envs=2, **({"policy_period": 0.001} if command else {}), **own)
    elif hasattr(made, "action_space"):
        env = made
    else:
        return
    observation, _ = env.reset(seed=3)
    for _ in range(STEPS):
        assert env.observation_space.contains(observation)
        action = command(env.measurement, env.reference).T if command else np.zeros(env.action_space.shape)
        assert np.isfinite(action).all()
        observation, reward, *_ = env.step(action)
        assert np.isfinite(reward).all()
        assert np.isfinite(env.simulation.plant.state).all()


def required(make):
    """Valid arguments of those that a class must have."""
    return {name: REQUIRED[name] for name, default in options_of(make).items() if default is inspect.Parameter.empty}


@cache
def used(name):
    """As it is made with what it must have, it works; compiled before time and memory count."""
    use(MADE[name](**required(MADE[name])))


@pytest.mark.parametrize("name", MADE)
@cases
@given(data=st.data())
def test_a_part_or_settings(name, data):
    used(name)
    options = options_of(MADE[name])
    how = required(MADE[name]) | data.draw(odd_options(options))
    with watched(*how, *options, "reference", "setpoint", "knots", runs_code=True, memory=CALLING):
        use(MADE[name](**how))


SLOW = {"nonlinear-mpc"}
POLICY = "residual"
"""It is nothing without a policy's file, which is fuzzed by itself."""
CONTROLLERS = [
    pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in names("controller") if name != POLICY
]


@cache
def commanded(name):
    use(make_controller(name, RIG))


@pytest.mark.parametrize("name", CONTROLLERS)
@cases
@given(data=st.data())
def test_a_controller(name, data):
    commanded(name)
    how = data.draw(odd_options(dict.fromkeys(known_options(name) or (), 1.0)))
    with watched(name, *how, runs_code=True, memory=CALLING):
        use(make_controller(name, RIG, **how))


FIELDS = {
    f"{section.name}.{field.name}": field.default
    for section in dataclasses.fields(RIG)
    if section.name != "ranges"
    for field in dataclasses.fields(getattr(RIG, section.name))
}


@cases
@given(changes=odd_options(FIELDS))
def test_parameters(changes):
    run_a_little(RIG)
    names = (name.rpartition(".")[2] for name in changes)
    with watched(*names, "reference", "k1", "dead_volume", "mass", "policy_period", memory=CALLING):
        run_a_little(RIG.replace(changes))
