"""Where pressure cells sit: in the chambers, or at the valves' ends of the tubes that lead there."""

from birthsim_env.loop.rows import World
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import CELL_AT_VALVE, PRESSURES


@helper
def pressure_at_cell(world: World, chamber: int, i: int) -> float:
    """True pressure at the cell of a chamber, Pa."""
    at_valve = world.rig[CELL_AT_VALVE, i] > 0.5
    pressure: float = world.at_valve[chamber, i] if at_valve else world.state[PRESSURES[chamber], i]
    return pressure
