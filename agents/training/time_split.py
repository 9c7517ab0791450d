"""Where the time of a policy step goes: the plant, the law with its residual, and what stands around them."""

from __future__ import annotations

import copy
import time
from typing import Any

from birthsim_env.loop.loop import MixedLoop
from birthsim_env.simulation import Simulation

REPEATS = 20
"""Policy steps over which each part is timed; the fastest counts, since other programs only add to it."""


def split(simulation: Simulation, seconds: float) -> dict[str, float]:
    """Fractions of ``seconds``, that a policy step of an environment takes: ``plant``, ``law`` and ``glue``, the rest.

    Plant and actuation are timed each by itself, on a copy: what is added to their sum is everything around them.
    """
    alone = copy.deepcopy(simulation)
    group, lanes, places = alone.pipeline.group, alone.plant.num_envs, alone.places()
    plant, acting = (MixedLoop(lanes, *places, parts) for parts in (group("plant"), [*group("actuation"), *group("board")]))
    found: dict[str, float] = {}
    for name, loop in (("plant", plant), ("law", acting)):
        spent = []
        for _ in range(REPEATS):
            started = time.perf_counter()
            loop.run(alone.periods, alone.threads)
            spent.append(time.perf_counter() - started)
        found[name] = min(1.0, min(spent) / seconds)
    return {**found, "glue": max(0.0, 1.0 - sum(found.values()))}


def shares(split: dict[str, float], environment: float) -> str:
    """The fractions of a training in words: ``split`` of what the ``environment`` takes, and the learner the rest."""
    parts: dict[str, Any] = {name: environment * part for name, part in split.items()}
    parts["learner"] = 1.0 - environment
    return ", ".join(f"{100 * part:.0f} % {name}" for name, part in parts.items())
