"""Users' paths on which kernels are called with arrays, or generated: what is called by address alone is known without them.

A path is a command of ``birthsim`` or a function. What is not on one is compiled by Numba when it is first asked for.
"""

from collections.abc import Callable

import gymnasium

from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names


def environments() -> None:
    """Every scenario with every sensor model, single and in lanes, and with what its actions add to a controller."""
    for scenario in names("scenario"):
        for sensors in names("sensors"):
            single = gymnasium.make(environment_id(scenario), sensors=sensors, randomize="all")
            lanes = gymnasium.make_vec(environment_id(scenario), num_envs=2, sensors=sensors, randomize="all")
            for env in (single, lanes):
                env.reset(seed=0)
                env.step(env.action_space.sample())
                env.close()
PATHS = {}
