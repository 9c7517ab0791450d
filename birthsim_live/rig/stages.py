"""The stage that only the page's rig has: what a frame shows of it."""

from birthsim_env.info import Info, describe
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import block
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.pneumatics import air, tubes

INSIDE = 6
"""Rows of what goes on inside the cylinders: friction of the pistons and the air that flows into the chambers."""

SHOWN = Info.size + INSIDE


@helper
def look_inside(x: Array, p: Array, ends: Array, rows: Array) -> None:
    """Writes friction of pistons 1 and 2, N, and what the valves of chambers P1, N1, P2, N2 let in, kg/s, (INSIDE, N).

    State ``x`` (18, N), parameters ``p`` (PARAMETERS, N), pressures at the ``ends`` of tubes (4, N).
    """
    for i in range(x.shape[1]):
        rows[0, i], _ = dynamics.piston_friction(x, p, i, 0)
        rows[1, i], _ = dynamics.piston_friction(x, p, i, 1)
        for k in range(4):
            end, coldness = tubes.at_valve(p, i, ends[k, i], x[at.PRESSURES[k], i], x[at.TEMPERATURES[k], i])
            supplied, exhausted = air.orifice_flows(p, i, k, end, x[at.SPOOLS[k], i], 1.0 / end, coldness)
            rows[2 + k, i] = supplied - exhausted


@kernel
def show(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes the fields of ``info``, and below them those of ``look_inside``, into its memory (SHOWN, N)."""
    rows = block(memory, SHOWN)
    describe(world, seen, Info(rows[: Info.size]), n)
    look_inside(world.state[:, :n], world.rig[:, :n], world.at_valve[:, :n], rows[Info.size :, :n])
    return 0
