"""The plant's stage differentiated: Runge-Kutta steps by their generated adjoints, and the end effector's motion.

The tape has the state at the beginning of a control period; its steps are computed again, with the same bits.
"""

import numpy as np

from birthsim_env.gradients import symbols, tracing
from birthsim_env.gradients.graph import Graph
from birthsim_env.gradients.right_hand_side import GENERATED as GENERATED
from birthsim_env.gradients.right_hand_side import INPUTS
from birthsim_env.gradients.steps import adjoint, back_over, lay_out
from birthsim_env.gradients.traced import Adjoint, Traced
from birthsim_env.loop.rows import FORCE, MOTION, OPENING, STATE, WORLD
from birthsim_env.loop.stage import Stage, block, carray, pointer, scratch
from birthsim_env.loop.world import Clock
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES
from birthsim_env.physics.linkage.geometry import end_effector_motion
from birthsim_env.physics.runge_kutta import STAGES

ROWS = [*range(STATE, STATE + STATES), *range(WORLD + OPENING, WORLD + OPENING + 4), FORCE, FORCE + 1]
"""Of the space, in the order of gradients: state, openings, force."""

BEGINNING, PUSHED = 0, INPUTS - 2
"""First point of a period, and the row at which the force stands."""


@kernel
def _back(tape: int, bars: int, out: int, rig: int, clock: Clock, lane: int, n: int) -> int:
    steps = int(clock.steps)
    step = clock.period / steps
    given, weighs, result, p = block(tape, INPUTS), block(bars, INPUTS), block(out, INPUTS), scratch(PARAMETERS)
    points = carray(pointer(out + 8 * BLOCK * INPUTS, np.float64), (STAGES * steps, STATES, BLOCK))
    g, late = scratch(STATES), scratch(STATES)
    x, sums, trial = scratch(STATES), scratch(STATES), scratch(STATES)
    u, f, by, total = scratch(4), scratch(2), scratch(INPUTS), scratch(INPUTS)
    dynamics.load(block(rig, PARAMETERS), 0, n, p)
    total[:STATES], by[:] = 0.0, 0.0
    dynamics.copy(weighs, late, n)
    dynamics.copy(weighs[STATES:], total[STATES:], n)
    dynamics.copy(given, points[BEGINNING], n)
    dynamics.copy(given[STATES:], u, n)
    dynamics.copy(given[PUSHED:], f, n)
    lay_out(points, u, f, p, steps, step, x, sums, trial, n)
    back_over(adjoint, points, u, f, p, steps, step, late, x, g, by, total, n)
    dynamics.settle(late, n)
    dynamics.copy(late, total[:STATES], n)
    dynamics.store(total, 0, n, result)
    return 0


def plant_adjoint(stage: Stage) -> Adjoint:
    """Of ``loop.world.plant_stage``, but for the motion of the end effector."""
    steps = int(stage.constants[Clock.steps.first])
    return Adjoint(_back, ROWS, ROWS, stage.constants, room=STAGES * steps * STATES)


def motion_traced() -> Traced:
    """What ``World.motion`` says of the state after a period."""
    graph = Graph()
    rig, state = symbols.inputs(graph, "p", PARAMETERS), symbols.inputs(graph, "x", STATES)
    motion = symbols.empty(4)
    tracing.call(end_effector_motion, state, rig, motion)
    inputs = {row: rig[row, 0] for row in range(PARAMETERS)} | {STATE + row: state[row, 0] for row in range(STATES)}
    return Traced("motion", graph, inputs, {MOTION + row: motion[row, 0] for row in range(4)})
