"""``birthsim warmup``: compile ahead what commands need first, so that the first one starts at once."""

import time
from dataclasses import dataclass
from typing import Any

import gymnasium
from tqdm import tqdm

from baselines.registry import LISTED, make_controller
from baselines.staged import NO_ACTION, driving
from birthsim_env.physics.rig.parameters import Parameters


@dataclass
class Settings:
    """Compile the kernels of every controller; they stay in the cache."""


def main(_: Settings) -> None:
    """Step each controller once."""
    rig, began = Parameters(), time.perf_counter()
    with tqdm(LISTED, desc="compiling", unit=" controllers", leave=False) as bar:
        for name in bar:
            env: Any = gymnasium.make(
                "BirthSIM/Circle-v1", sensors="lab", policy_period=rig.electronics.control_period,
                actuation=driving(make_controller(name, rig), name),
            )  # fmt: skip
            env.reset(seed=0)
            env.step(NO_ACTION)
            env.close()
    print(f"{len(LISTED)} controllers are compiled: {time.perf_counter() - began:.1f} s")
