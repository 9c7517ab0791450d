"""The loops of environments as ``Pieces``."""

from collections.abc import Sequence

import numpy as np

from baselines.staged import Driving, driving
from birthsim_build.device.program import Pieces
from birthsim_build.loops import compiled_law
from birthsim_env.assembly import assemble
from birthsim_env.episodes import Episodes
from birthsim_env.loop.stage import Stage
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.simulation import Simulation

SEVERAL = (3, 2)
"""Two numbers of lanes, which tell what lanes have of their own."""


def pieces_of(simulation: Simulation, commanded: Sequence[Stage] = (), moved: Sequence[Stage] = ()) -> Pieces:
    """The loop of lanes that have begun; ``ValueError`` names the argument that is a user's Python, which no device runs.

    Stages that look on, once the valves are ``commanded`` or the rig has ``moved``, stand where ``Simulation.watch`` puts them.
    """
    parts = simulation.parts()
    parts = {**parts, "actuation": [*parts["actuation"], *commanded], "sensors": [*moved, *parts["sensors"]]}
    arguments = {
        "actuation": simulation.actuation, "board": simulation.sensors, "target": simulation.trajectory,
        "setpoints": simulation.stiffness, "hand": simulation.user_force, "sensors": simulation.sensors,
    }  # fmt: skip
    names = {"target": "reference", "setpoints": "stiffness", "hand": "user_force", "board": "sensors"}
    if isinstance(simulation.actuation, Driving):
        arguments["actuation"], names["actuation"] = simulation.actuation.controller, "controller"
    stages = []
    for part, group in parts.items():
        for one in group:
            if not isinstance(one, Stage):
                owner = type(arguments[part]).__name__
                raise ValueError(f"{names.get(part, part)} = {owner}, in Python; allowed on a device: what is compiled")
            stages.append(one)
    return Pieces(*simulation.places(), stages, simulation.closing)


def controlled(scenario: str, sensors: str, rig: Parameters, controller: str, seed: int, lanes: int) -> Episodes:
    """``lanes`` of a scenario under a compiled controller, where the episode seeded ``seed`` begins in each."""
    law = compiled_law(controller, rig)
    episodes = Episodes(assemble(lanes, scenario, sensors=sensors, parameters=rig, actuation=driving(law, controller)))
    episodes.begin_first([seed] * lanes, np.zeros(lanes, dtype=np.int64))
    return episodes
