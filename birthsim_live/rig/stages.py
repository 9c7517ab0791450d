"""Stages that only the page's rig has: its start, and what a frame shows of it."""

from birthsim_env.info import Info, describe
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import block, scratch
from birthsim_env.loop.world import FurtherStates
from birthsim_env.physics import dynamics, friction, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.equilibrium import balance
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.inverse_kinematics import piston_motion

INSIDE = 6
"""Rows of what goes on inside the cylinders: friction of the pistons and the air that flows into the chambers."""

SHOWN = Info.size + INSIDE


@kernel
def begin(world: World, seen: Seen, memory: FurtherStates, described: Rig, tables: int, lane: int, n: int) -> int:
    """Puts the pistons on the reference, in balance, as ``Simulation.begin``. ``described`` is what its owner knows.

    ``memory`` takes what the plant remembers there.
    """
    p, x, joints = world.rig[:, :n], world.state[:, :n], scratch(4)
    piston_motion(seen.reference.rows, described, joints, n)
    for i in range(n):
        for row in range(at.STATES):
            x[row, i] = 0.0
        x[at.Y1, i], x[at.Y2, i], x[at.V1, i], x[at.V2, i] = joints[0, i], joints[1, i], joints[2, i], joints[3, i]
    balance(x, seen.reference.pneumatic_stiffness[:, :n], p)
    end_effector_motion(x, p, world.motion.rows[:, :n])
    for i in range(n):
        for valve in range(4):
            memory.inner[valve, i] = 0.0
    options.rest(x, p, memory.further[:, :n])
    return 0


@helper
def piston_friction(x: Array, p: Array, i: int, speed: int, bristle: int, coulomb: int, static: int, viscous: int) -> float:
    """Friction on the rod, N, as in ``dynamics.right_hand_side``: along the motion it is positive and holds it back."""
    v, z, s0 = x[speed, i], x[bristle, i], p[at.S0, i]
    if p[at.LUGRE, i] + p[at.ELASTO_PLASTIC, i] <= 0.5:
        return friction.coulomb_force(v, p[coulomb, i], p[viscous, i], p[at.SIGN_SLOPE, i])
    weakness = friction.inverse_level(v, p[coulomb, i], p[static, i], p[at.STRIBECK, i])
    rate = friction.bristle_rate_by_law(v, z, weakness, s0, p[at.LUGRE, i] > 0.5, p[at.BREAKAWAY, i], p[at.STEEPNESS, i])
    return friction.lugre_force(v, z, rate, s0, p[at.S1, i], p[viscous, i])


@helper
def look_inside(x: Array, p: Array, rows: Array) -> None:
    """Writes friction of pistons 1 and 2, N, and net flows into chambers P1, N1, P2, N2, kg/s, (INSIDE, N).

    State ``x`` (18, N), parameters ``p`` (PARAMETERS, N).
    """
    for i in range(x.shape[1]):
        rows[0, i] = piston_friction(x, p, i, at.V1, at.Z1, at.FC1, at.FS1, at.FV1)
        rows[1, i] = piston_friction(x, p, i, at.V2, at.Z2, at.FC2, at.FS2, at.FV2)
        for k in range(4):
            supplied, exhausted = dynamics.flows_of(x, p, i, at.PRESSURES[k], at.TEMPERATURES[k], at.SPOOLS[k])
            rows[2 + k, i] = supplied - exhausted


@kernel
def show(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes the fields of ``info``, and below them those of ``look_inside``, into its memory (SHOWN, N)."""
    rows = block(memory, SHOWN)
    describe(world, seen, Info(rows[: Info.size]), n)
    look_inside(world.state[:, :n], world.rig[:, :n], rows[Info.size :, :n])
    return 0
