"""Users' paths on which kernels are called with arrays, or generated; what loops call by address is known without them.

A path is a command of ``birthsim``, whose results go to the folder ``{out}``, or a function. What is on none of them Numba
compiles when it is first asked for. Gradients have a kernel a stage, each generated for what its loop differentiates: those of
a policy without a law below it are the same in every scenario.
"""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from baselines.named import controlling_names, make_controller
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names

RIG = Parameters()


def environments() -> None:
    """Every scenario with every sensor model, alone and in lanes."""
    for scenario in names("scenario"):
        for sensors in names("sensors"):
            for env in (
                gymnasium.make(environment_id(scenario), sensors=sensors, randomize=True),
                gymnasium.make_vec(environment_id(scenario), num_envs=2, sensors=sensors, randomize=True),
            ):
                env.reset(seed=0)
                env.step(env.action_space.sample())
                env.close()


def controllers() -> None:
    """Every controller, called with what an environment measures."""
    env: Any = gymnasium.make_vec(environment_id("circle"), num_envs=2, sensors="lab")
    env.reset(seed=0)
    for name in controlling_names():
        make_controller(name, RIG).command(env.measurement, env.reference)


def physics() -> None:
    """The plant without an environment, and the elementary functions."""
    plant = Plant(RIG, 2)
    plant.advance(np.zeros((4, 2)), np.zeros((2, 2)), 1e-3)
    exact.direction(np.zeros(2))
    exact.number("sine", 0.0)


PATHS: dict[str, Callable[[], None] | tuple[str, ...]] = {
    "environments": environments,
    "controllers": controllers,
    "physics": physics,
    "figure4": ("figure4", "--out", "{out}/figure4"),
    "evaluate": (
        *("evaluate", "--controller", "backstepping", "residual", "--policy", "circle"),
        *("--episodes", "1", "--jobs", "1", "--out", "{out}/evaluation"),
    ),
    "train": ("train", "--config", "circle_quick", "--steps", "1", "--out", "{out}/training"),
    "train by gradients": ("train", "--config", "circle_apg", "--steps", "1", "--out", "{out}/training"),
}
