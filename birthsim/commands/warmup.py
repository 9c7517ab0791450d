"""``birthsim warmup``: compile ahead what has no prebuilt code, so that the first command starts at once."""

import time
from dataclasses import dataclass

from tqdm import tqdm

from baselines.driving import NO_ACTION
from baselines.named import compiled_names
from birthsim.recorded import driven
from birthsim_env.physics.rig.parameters import Parameters


@dataclass
class Settings:
    """Compile the kernels of every controller that are not prebuilt; they stay in the cache."""


def main(_: Settings) -> None:
    """Step each controller once."""
    rig, began, names = Parameters(), time.perf_counter(), compiled_names(listed=True)
    with tqdm(names, desc="compiling", unit=" controllers", leave=False) as bar:
        for name in bar:
            env = driven("BirthSIM/Circle-v2", name, rig, sensors="lab")
            env.reset(seed=0)
            env.step(NO_ACTION)
            env.close()
    print(f"{len(names)} controllers are ready: {time.perf_counter() - began:.1f} s")
