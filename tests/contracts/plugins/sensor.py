"""A sensor model of a user's own, compiled into the loop: positions in whole millimetres."""

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.sensors.ideal import IdealSensors, ideal_stage
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.registry import register


class Step(Numbers):
    step = number("m", "of the position")


@kernel
def coarse(world: World, seen: Seen, memory: int, constants: Step, tables: int, lane: int, n: int):
    ideal_stage(world, seen, memory, 0, tables, lane, n)
    for axis in range(2):
        for i in range(n):
            seen.position[axis, i] = constants.step * np.floor(seen.position[axis, i] / constants.step + 0.5)
    return 0


@register(sensors="coarse", about="Positions in whole millimetres.")
class CoarseSensors(IdealSensors):
    def stage(self):
        return Stage(coarse, Step.numbers(step=1e-3))
