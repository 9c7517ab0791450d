"""Loops of environments whose episodes begin where they run."""

import numpy as np

from birthsim_build.device.drawing import drawing
from birthsim_build.device.loops import pieces_of
from birthsim_build.device.program import Pieces
from birthsim_env.episodes import Episodes


def beginning_with(episodes: Episodes) -> Pieces:
    """The loop of ``episodes``, with what begins them; ``ValueError`` for a part that is a user's Python.

    Its first lane is left as an episode is before its world is drawn: for all that an episode does not draw.
    """
    simulation = episodes.simulation
    pieces_of(simulation)  # refuses what is not compiled
    episodes.begin_first([0], np.zeros(1, dtype=np.int64))
    draws, rng = drawing(simulation), np.random.default_rng(0)
    # What has looked at the first instant forgets that.
    for part in (simulation.trajectory, simulation.user_force, simulation.stiffness, simulation.sensors):
        part.begin(0, rng)
    episodes.forget(np.arange(simulation.plant.num_envs) == 0)
    pieces = pieces_of(simulation, begins=True)
    return pieces._replace(beginning=[draws, *pieces.beginning])
