"""What a sensor model looks at where Python calls it instead of the closed loop."""

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Signals, World
from birthsim_env.physics.compiled.lanes import PRESSURES, Array


def looked_at(
    ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array
) -> tuple[World, Signals]:  # fmt: skip
    """The world of N lanes, as far as sensors know it, and the signals that they write."""
    world, seen = World(np.zeros((World.size, len(time)))), Signals(np.zeros((Signals.size, len(time))))
    world.tick[:], world.motion.rows[:], world.force[:], seen.time[:] = ticks, motion, force, time
    world.state[list(PRESSURES)] = pressures
    return world, seen
