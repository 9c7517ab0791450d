"""Stages that only the page's rig has: its start, and what a frame shows of it."""

from birthsim_env.info import Info, describe
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import block, scratch
from birthsim_env.loop.world import FurtherStates
from birthsim_env.physics import options
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import STATES, V1, V2, Y1, Y2, Rig
from birthsim_env.physics.equilibrium import balance
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.inverse_kinematics import piston_motion
from birthsim_live.rig import inside
from birthsim_live.rig.inside import look_inside

SHOWN = Info.size + inside.ROWS


@kernel
def begin(world: World, seen: Seen, memory: FurtherStates, described: Rig, tables: int, lane: int, n: int) -> int:
    """Puts the pistons on the reference, in balance, as ``Simulation.begin``. ``described`` is what its owner knows.

    ``memory`` takes what the plant remembers there.
    """
    p, x, joints = world.rig[:, :n], world.state[:, :n], scratch(4)
    piston_motion(seen.reference.rows, described, joints, n)
    for i in range(n):
        for row in range(STATES):
            x[row, i] = 0.0
        x[Y1, i], x[Y2, i], x[V1, i], x[V2, i] = joints[0, i], joints[1, i], joints[2, i], joints[3, i]
    balance(x, seen.reference.pneumatic_stiffness[:, :n], p)
    end_effector_motion(x, p, world.motion.rows[:, :n])
    for i in range(n):
        for valve in range(4):
            memory.inner[valve, i] = 0.0
    options.rest(x, p, memory.further[:, :n])
    return 0


@kernel
def show(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes the fields of ``info``, and below them those of ``inside``, into its memory (SHOWN, N)."""
    rows = block(memory, SHOWN)
    describe(world, seen, Info(rows[: Info.size]), n)
    look_inside(world.state[:, :n], world.rig[:, :n], rows[Info.size :, :n])
    return 0
