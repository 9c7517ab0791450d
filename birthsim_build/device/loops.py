"""The loops of environments as ``Pieces``."""

from typing import Any

import numpy as np

from baselines.driving import Driving, driving
from birthsim_build.device.program import Pieces
from birthsim_build.loops import compiled_law
from birthsim_env.assembly import assemble
from birthsim_env.episodes import Episodes
from birthsim_env.loop.pipeline import Called
from birthsim_env.loop.stage import Stage
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.simulation import Simulation

SEVERAL = (3, 2)
"""Two numbers of lanes, which tell what lanes have of their own."""


NAMES = {"target": "reference", "setpoints": "stiffness", "hand": "user_force", "board": "sensors"}
"""The argument of an environment that a step is made of, where that has another name."""


def pieces_of(simulation: Simulation, begins: bool = False) -> Pieces:
    """The loop of lanes that have begun, with what runs where an episode ``begins``.

    ``ValueError`` names the argument that is a user's Python, which no device runs."""
    pipeline = simulation.pipeline
    for step in pipeline:
        for part in (step.part, step.begin):
            if isinstance(part, Stage | None):
                continue
            name, owner = NAMES.get(step.group, step.name), part.owner if isinstance(part, Called) else part
            if isinstance(owner, Driving):
                name, owner = "controller", owner.controller
            raise ValueError(f"{name} = {type(owner).__name__}, in Python; allowed on a device: what is compiled")
    groups: Any = (pipeline.every_period, pipeline.closing, pipeline.beginning if begins else ())
    return Pieces(*simulation.places(), *groups)


def controlled(scenario: str, sensors: str, rig: Parameters, controller: str, seed: int, lanes: int) -> Episodes:
    """``lanes`` of a scenario under a compiled controller, where the episode seeded ``seed`` begins in each."""
    law = compiled_law(controller, rig)
    episodes = Episodes(assemble(lanes, scenario, sensors=sensors, parameters=rig, actuation=driving(law, controller)))
    episodes.begin_first([seed] * lanes, np.zeros(lanes, dtype=np.int64))
    return episodes
