"""The sensor model ``ideal``, which sees everything at every control period."""

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.sensors.cells import pressure_at_cell
from birthsim_env.parts.sensors.model import SensorModel
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.registry import register


@kernel
def ideal_stage(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Shows position, velocity, pressures and the hand's force as they are."""
    place, speed = world.motion.position, world.motion.velocity
    for i in range(n):
        seen.position_time[i] = seen.time[i]
        for axis in range(2):
            seen.position[axis, i], seen.velocity[axis, i] = place[axis, i], speed[axis, i]
            seen.user_force[axis, i] = world.force[axis, i]
        for chamber in range(4):
            seen.pressure[chamber, i] = pressure_at_cell(world, chamber, i)
    return 0


@register(sensors="ideal", about="Every quantity is known exactly and at once.", order=1)
class IdealSensors(SensorModel):
    """Position, velocity, pressures and the user's force, exact and at once."""

    def stage(self) -> Stage:
        return Stage(ideal_stage)
