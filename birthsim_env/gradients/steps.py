"""Runge-Kutta steps differentiated: kernels over lanes that walk a tape of states back, or carry a tangent along.

The tape has the state before every step; going back, the trial states of a step are computed again, with the same bits.
What ``dynamics.settle`` sets to zero, below 1e-30, counts as if it went on.
"""

from collections.abc import Callable

import numpy as np

from birthsim_env.gradients.right_hand_side import EVERY, INPUTS, made
from birthsim_env.gradients.right_hand_side import GENERATED as GENERATED
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import load, store
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of

adjoint, adjoint_rig, tangent_rig = made.adjoint, made.adjoint_rig, made.tangent_rig


@helper
def lay_out(
    points: Array,
    u: Array,
    f: Array,
    p: Array,
    steps: int,
    step: float,
    x: Array,
    total: Array,
    trial: Array,
    n: int,
) -> None:
    """Fills ``points`` (STAGES steps, 18, n), of which the first is given, with the states at which rates are taken."""
    for k in range(STAGES * steps - 1):
        stage = k % STAGES
        if stage == 0:
            dynamics.copy(points[k], x, n)
            dynamics.copy(x, total, n)
            dynamics.copy(x, trial, n)
        dynamics.stage(x, u, f, p, total, trial, n, 1, weight_of(stage, step), ahead_of(stage, step))
        dynamics.copy(total if stage == STAGES - 1 else trial, points[k + 1], n)


@helper
def seed(late: Array, out: Array, weight: float, ahead: float, g: Array, n: int) -> None:
    """Writes what the end of a step and the next stage's state ask of the rates of a stage, (18, n)."""
    for row in range(at.STATES):
        for i in range(n):
            g[row, i] = weight * late[row, i] + ahead * out[row, i]


@helper
def add(out: Array, total: Array, n: int) -> None:
    """Adds a stage's gradients to those of the step."""
    for row in range(total.shape[0]):
        for i in range(n):
            total[row, i] += out[row, i]


@helper
def take_in(total: Array, late: Array, n: int) -> None:
    """Ends a step: its gradients to the state join ``late`` (18, n), the others stay in ``total``."""
    for row in range(at.STATES):
        for i in range(n):
            late[row, i] += total[row, i]
            total[row, i] = 0.0


@helper
def back_over(
    walk: Callable[..., None],
    points: Array,
    u: Array,
    f: Array,
    p: Array,
    steps: int,
    step: float,
    late: Array,
    x: Array,
    g: Array,
    out: Array,
    total: Array,
    n: int,
) -> None:
    """Takes the gradient ``late`` (18, n) at the end of the steps of ``points`` to their beginning.

    What it has to openings and force, and where ``walk`` is ``adjoint_rig`` to the rig's parameters, grows in rows of ``total``
    (INPUTS or EVERY, n), whose first 18 are zero.
    """
    for k in range(STAGES * steps - 1, -1, -1):
        stage = k % STAGES
        seed(late, out, weight_of(stage, step), ahead_of(stage, step), g, n)
        dynamics.copy(points[k], x, n)
        walk(x, u, f, p, g, out, n)
        add(out, total, n)
        if stage == 0:
            take_in(total, late, n)


@kernel
def advance(
    state: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, impacts: Array, tape: Array
) -> None:
    """``dynamics.advance``, which keeps the state before every step in ``tape`` (blocks, K steps, 18, BLOCK)."""
    x, u, f = np.empty((at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, hit = np.empty((at.PARAMETERS, BLOCK)), np.empty((2, BLOCK))
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(command, first, n, u)
        load(parameters, first, n, p)
        hit[:] = 0.0
        for k in range(tape.shape[1]):
            load(forces[k // steps], first, n, f)
            store(x, 0, n, tape[first // BLOCK, k])
            dynamics.integrate(x, u, f, p, 1, step, hit, n)
        dynamics.settle(x, n)
        store(x, first, n, state)
        store(hit, first, n, impacts)


@kernel
def backward(
    tape: Array,
    command: Array,
    forces: Array,
    parameters: Array,
    steps: int,
    step: float,
    late: Array,
    by_force: Array,
    rig: bool,
    result: Array,
) -> None:
    """Gradients for ``late`` (18, N) at the end of a tape: ``result`` (EVERY, N) to the state at its beginning, the openings,
    and with ``rig`` the parameters; ``by_force`` (K, 2, N) to the samples of the force."""
    points, u, f = np.empty((STAGES, at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, g = np.empty((at.PARAMETERS, BLOCK)), np.empty((at.STATES, BLOCK))
    x, lam, sums = np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK))
    trial = np.empty((at.STATES, BLOCK))
    out, total = np.empty((EVERY, BLOCK)), np.empty((EVERY, BLOCK))
    for first in range(0, late.shape[1], BLOCK):
        n = min(BLOCK, late.shape[1] - first)
        load(command, first, n, u)
        load(parameters, first, n, p)
        load(late, first, n, lam)
        total[:], out[:] = 0.0, 0.0
        for k in range(tape.shape[1] - 1, -1, -1):
            load(tape[first // BLOCK, k], 0, n, points[0])
            load(forces[k // steps], first, n, f)
            lay_out(points, u, f, p, 1, step, x, sums, trial, n)
            if rig:
                back_over(adjoint_rig, points, u, f, p, 1, step, lam, x, g, out, total, n)
            else:
                back_over(adjoint, points, u, f, p, 1, step, lam, x, g, out[:INPUTS], total[:INPUTS], n)
            dynamics.settle(lam, n)
            if k % steps == 0:
                store(total[INPUTS - 2 : INPUTS], first, n, by_force[k // steps])
                total[INPUTS - 2 : INPUTS] = 0.0
        dynamics.copy(lam, total[: at.STATES], n)
        store(total, first, n, result)


@helper
def move(
    x: Array, s: Array, out: Array, x0: Array, s0: Array, total: Array, late: Array, weight: float, ahead: float, n: int
) -> None:
    """A stage of state and tangent together; ``out`` (36, n) has the rates of the tangent and then those of the state."""
    for row in range(at.STATES):
        for i in range(n):
            total[row, i] += weight * out[at.STATES + row, i]
            late[row, i] += weight * out[row, i]
            x[row, i] = x0[row, i] + ahead * out[at.STATES + row, i]
            s[row, i] = s0[row, i] + ahead * out[row, i]


@kernel
def advance_tangent(
    state: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, along: Array, by_force: Array
) -> None:
    """Integrates ``state`` (18, N) as ``dynamics.advance`` and, in its first 18 rows, its tangent ``along`` (EVERY, N).

    The other rows are tangents of openings and rig; ``by_force`` (K, 2, N) is that of the force.
    """
    x, u, f = np.empty((at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, s, out = np.empty((at.PARAMETERS, BLOCK)), np.empty((EVERY, BLOCK)), np.empty((2 * at.STATES, BLOCK))
    x0, s0 = np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK))
    total, late = np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK))
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(command, first, n, u)
        load(parameters, first, n, p)
        load(along, first, n, s)
        for k in range(steps * forces.shape[0]):
            load(forces[k // steps], first, n, f)
            load(by_force[k // steps], first, n, s[INPUTS - 2 : INPUTS])
            for kept, now in ((x0, x), (s0, s), (total, x), (late, s)):
                dynamics.copy(now, kept, n)
            for stage in range(STAGES):
                tangent_rig(x, u, f, p, s, out, n)
                move(x, s, out, x0, s0, total, late, weight_of(stage, step), ahead_of(stage, step), n)
            dynamics.copy(total, x, n)
            dynamics.copy(late, s[: at.STATES], n)
        dynamics.settle(x, n)
        store(x, first, n, state)
        store(s, first, n, along)
