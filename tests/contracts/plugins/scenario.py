"""A scenario of a user's own and its id: a stroll of 40 mm along x under a push."""

import gymnasium

from birthsim_env import Path, StiffnessSchedule
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.scenarios import SCENARIOS, Scenario


def parts():
    return Path((0.48, 0.0), 0.0, 0.04, ends=2.0), Ramp(amplitude=15.0), StiffnessSchedule()


SCENARIOS["stroll"] = Scenario("A stroll of 40 mm", 3.0, parts, parts)
gymnasium.register(
    "Mine/Stroll-v0",
    "birthsim_env.env:BirthSIMEnv",
    vector_entry_point="birthsim_env.vector_env:BirthSIMVectorEnv",
    kwargs={"scenario": "stroll"},
)
