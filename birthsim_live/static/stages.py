"""Stages that only a rig in the browser needs: its start, and what a frame shows.

They wrap the kernels of the packages, so that the browser computes what Python computes.
"""

from __future__ import annotations

from birthsim_env.info import ROWS, describe
from birthsim_env.loop.rows import (
    FORCE,
    IMPACT,
    MOTION,
    REFERENCE,
    SEEN,
    SINCE_JUMP,
    STATE,
    TIME,
    WORLD,
)
from birthsim_env.loop.stage import block, numbers, scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, V1, V2, Y1, Y2
from birthsim_env.physics.equilibrium import balance
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.inverse_kinematics import piston_motion
from birthsim_live.rig import inside
from birthsim_live.rig.inside import look_inside

SHOWN = ROWS + inside.ROWS


@kernel
def begin(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Puts the pistons on the reference, in balance, as ``Simulation.begin``. Constants: the rig as its owner describes it."""
    w, s, nominal = block(world, WORLD), block(seen, SEEN), numbers(constants, PARAMETERS)
    p, x, joints = w[:PARAMETERS, :n], w[STATE : STATE + STATES, :n], scratch(4)
    piston_motion(s[REFERENCE : REFERENCE + 4], nominal, joints, n)
    for i in range(n):
        for row in range(STATES):
            x[row, i] = 0.0
        x[Y1, i], x[Y2, i], x[V1, i], x[V2, i] = joints[0, i], joints[1, i], joints[2, i], joints[3, i]
    balance(x, s[REFERENCE + 10 : REFERENCE + 12, :n], p)
    end_effector_motion(x, p, w[MOTION : MOTION + 4, :n])
    return 0


@kernel
def show(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes the fields of ``info``, and below them those of ``inside``, into its memory (SHOWN, N)."""
    w, s, rows = block(world, WORLD), block(seen, SEEN), block(memory, SHOWN)
    describe(
        s[TIME, :n], w[SINCE_JUMP, :n], w[STATE : STATE + STATES, :n], w[MOTION : MOTION + 4, :n],
        s[REFERENCE : REFERENCE + 15, :n], w[FORCE : FORCE + 2, :n], w[IMPACT : IMPACT + 2, :n], w[:PARAMETERS, :n],
        rows[:ROWS, :n],
    )  # fmt: skip
    look_inside(w[STATE : STATE + STATES, :n], w[:PARAMETERS, :n], rows[ROWS:, :n])
    return 0
