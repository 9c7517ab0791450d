"""The sensor model ``encoder``: positions in whole steps, as linear encoders count them."""

import math

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.sensors.ideal import IdealSensors, ideal_stage
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.registry import register

STEP = 5e-5
"""m; assumed."""


class Steps(Numbers):
    """What encoders count in."""

    size_of_one = number("m", "distance between two counts")


@kernel
def count(world: World, seen: Seen, memory: int, steps: Steps, tables: int, lane: int, n: int) -> int:
    """Show what ``ideal`` sensors show, with positions in whole steps."""
    ideal_stage(world, seen, 0, 0, 0, lane, n)
    for i in range(n):
        for axis in range(2):
            counted = math.floor(seen.position[axis, i] / steps.size_of_one + 0.5)
            seen.position[axis, i] = steps.size_of_one * counted
    return 0


@register(sensors="encoder", about="Encoders that count whole steps of 0.05 mm; all else is exact.")
class EncoderSensors(IdealSensors):
    """Positions in whole steps; pressures, velocities and the user's force are exact and at once."""

    def stage(self) -> Stage:
        return Stage(count, Steps.numbers(size_of_one=STEP))
