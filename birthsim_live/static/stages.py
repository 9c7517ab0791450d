"""Stages that only a rig in the browser needs: its start, what a frame shows, what a policy sees, and a layer of its network.

They wrap the kernels of the packages, so that the browser computes what Python computes.
"""

from __future__ import annotations

from agents.policy.network import layer
from birthsim_env.info import ROWS, describe
from birthsim_env.loop.rows import (
    ACTION,
    FORCE,
    IMPACT,
    MOTION,
    POSITION,
    POSITION_TIME,
    PRESSURE,
    REFERENCE,
    SEEN,
    SHOWN,
    SINCE_JUMP,
    STATE,
    TIME,
    USER_FORCE,
    VELOCITY,
    WORLD,
)
from birthsim_env.loop.stage import block, numbers, scratch, singles, table2
from birthsim_env.observation import SCALES, SIZE, look
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, V1, V2, Y1, Y2
from birthsim_env.physics.equilibrium import balance
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.inverse_kinematics import piston_motion


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
    """Writes the fields of ``info`` into its memory (ROWS, N)."""
    w, s, rows = block(world, WORLD), block(seen, SEEN), block(memory, ROWS)
    describe(
        s[TIME, :n], w[SINCE_JUMP, :n], w[STATE : STATE + STATES, :n], w[MOTION : MOTION + 4, :n],
        s[REFERENCE : REFERENCE + 15, :n], w[FORCE : FORCE + 2, :n], w[IMPACT : IMPACT + 2, :n], w[:PARAMETERS, :n],
        rows[:, :n],
    )  # fmt: skip
    return 0


@kernel
def see(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """What a policy sees, of one lane. Constants: length of an action, rows shown of the law, the rig as its owner describes
    it. Table: the observation, of single precision, (1, D)."""
    s, about, scales = block(seen, SEEN), numbers(constants, 2 + PARAMETERS), scratch(SIZE)[:, 0]
    for k in range(SIZE):
        scales[k] = SCALES[k]
    size, shown = int(about[0]), int(about[1])
    look(
        s[POSITION:VELOCITY, :1], s[VELOCITY:POSITION_TIME, :1], s[PRESSURE:USER_FORCE, :1],
        s[REFERENCE : REFERENCE + 15, :1], s[USER_FORCE:REFERENCE, :1], s[ACTION : ACTION + size, :1],
        s[SHOWN : SHOWN + shown, :1], about[2:], scales, singles(tables, 0),
    )  # fmt: skip
    return 0


@kernel
def neurons(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """A layer of a policy's network. Constant: 1 for tanh. Tables: inputs (1, m), W (m, n) and b (1, n) of single precision,
    outputs (1, n)."""
    squashed = numbers(constants, 1)[0] > 0.0
    layer(table2(tables, 0), singles(tables, 1), singles(tables, 2)[0], squashed, table2(tables, 3))
    return 0
