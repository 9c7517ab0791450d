"""States of environments, which compiled code goes on from: entries gone, renamed, new, and with odd numbers."""

import json
from functools import cache

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import agents
from tests.fuzz.strategies import altered, odd_arrays, sampled
from tests.fuzz.watched import cases, watched

assert agents  # registers the environments with a law inside

WORLDS = {
    "honest": {"id": "BirthSIM/Circle-v2", "sensors": "honest", "randomize": True},
    "lab": {"id": "BirthSIM/Descent-v2", "sensors": "lab", "randomize": True},
    "guided": {"id": "BirthSIM/Circle-v2", "user_force": "guided"},
    "residual": {"id": "BirthSIM/CircleResidual-v2", "law": "admittance", "sensors": "lab"},
}
STEPS = 3


@cache
def world(name):
    """An environment, and its state after a step; as it is, it is taken."""
    env = gymnasium.make_vec(num_envs=2, **WORLDS[name])
    env.reset(seed=0)
    env.step(np.zeros(env.action_space.shape))
    state = env.get_state()
    env.set_state(state)
    return env, state


@pytest.mark.parametrize("name", WORLDS)
@cases
@given(data=st.data())
def test_a_state(name, data):
    env, good = world(name)
    arrays = {one: array for one, array in good.items() if one != "plain"}
    state = {**data.draw(sampled([arrays]) | odd_arrays(arrays)), "plain": good["plain"]}
    if data.draw(st.booleans()):
        plain = data.draw(altered(json.loads(good["plain"].tobytes()), st.none() | st.booleans() | st.integers() | st.text()))
        state["plain"] = np.frombuffer(json.dumps(plain).encode(), dtype=np.uint8)
    try:
        with watched("state", "setpoint"):
            env.set_state(state)
            for _ in range(STEPS):
                env.step(np.zeros(env.action_space.shape))
    finally:
        env.set_state(good)
