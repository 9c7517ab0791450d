"""The sensor model ``camera``: positions in whole pixels, as a camera above the rig shows them."""

import math

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.sensors.ideal import IdealSensors, ideal_stage
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.registry import register

PIXEL = 5e-5
"""m; assumed."""


class Pixels(Numbers):
    """What a camera counts in."""

    size_of_one = number("m", "width of a pixel")


@kernel
def picture(world: World, seen: Seen, memory: int, pixels: Pixels, tables: int, lane: int, n: int) -> int:
    """Show what ``ideal`` sensors show, with positions in whole pixels."""
    ideal_stage(world, seen, 0, 0, 0, lane, n)
    for i in range(n):
        for axis in range(2):
            counted = math.floor(seen.position[axis, i] / pixels.size_of_one + 0.5)
            seen.position[axis, i] = pixels.size_of_one * counted
    return 0


@register(sensors="camera", about="A camera with pixels of 0.05 mm; all else is exact.")
class CameraSensors(IdealSensors):
    """Positions in whole pixels; pressures, velocities and the user's force are exact and at once."""

    def stage(self) -> Stage:
        return Stage(picture, Pixels.numbers(size_of_one=PIXEL))
