"""Runge-Kutta steps differentiated: kernels over lanes that walk a tape of states back, or carry tangents along.

The tape has the state before every step; going back, the three trial states of a step are computed again, with the same bits.
What ``dynamics.settle`` sets to zero, below 1e-30, counts as if it went on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import BLOCK, helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import load, store
from birthsim_env.physics.gradients.right_hand_side import ENTRIES, EVERY, INPUTS, made
from birthsim_env.physics.gradients.right_hand_side import GENERATED as GENERATED

STAGES = 4
SLOPES = len(ENTRIES)
SPAN, VECTOR = 8, 4
"""Lanes that tangents are carried along for at once: those of thirty directions stay in the second-level cache. Their number is
rounded up to whole vectors, where the last lane repeats."""
adjoint, adjoint_rig, slopes, slopes_rig, carry = made.adjoint, made.adjoint_rig, made.slopes, made.slopes_rig, made.carry


@helper
def weight_of(stage: int, step: float) -> float:
    """What the rates of a stage count for at the end of the step, s."""
    return step / 6.0 if stage == 0 or stage == 3 else step / 3.0


@helper
def ahead_of(stage: int, step: float) -> float:
    """How far a stage's rates take the next trial state, s."""
    return 0.0 if stage == 3 else step if stage == 2 else step / 2.0


@helper
def lay_out(
    points: Array, u: Array, f: Array, p: Array, steps: int, step: float, x: Array, dx: Array, total: Array, trial: Array,
    n: int,
) -> None:  # fmt: skip
    """Fills ``points`` (STAGES steps, 18, n), of which the first is given, with the states at which rates are taken."""
    for k in range(STAGES * steps - 1):
        stage = k % STAGES
        if stage == 0:
            dynamics.copy(points[k], x, n)
            dynamics.copy(x, total, n)
            dynamics.copy(x, trial, n)
        dynamics.right_hand_side(trial, u, f, p, dx, n)
        dynamics.stage(x, dx, total, trial, n, weight_of(stage, step), ahead_of(stage, step))
        dynamics.copy(total if stage == 3 else trial, points[k + 1], n)


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
    walk: Callable[..., None], points: Array, u: Array, f: Array, p: Array, steps: int, step: float, late: Array, x: Array,
    g: Array, out: Array, total: Array, n: int,
) -> None:  # fmt: skip
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
    """``dynamics.advance``, which keeps the state before every step in ``tape`` (K steps, 18, N)."""
    x, u, f = np.empty((at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, dx = np.empty((at.PARAMETERS, BLOCK)), np.empty((at.STATES, BLOCK))
    total, trial, hit = np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK)), np.empty((2, BLOCK))
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(command, first, n, u)
        load(parameters, first, n, p)
        hit[:] = 0.0
        for k in range(tape.shape[0]):
            load(forces[k // steps], first, n, f)
            store(x, first, n, tape[k])
            dynamics.integrate(x, u, f, p, 1, step, hit, dx, total, trial, n)
        dynamics.settle(x, n)
        store(x, first, n, state)
        store(hit, first, n, impacts)


@kernel
def backward(
    tape: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, late: Array, by_force: Array,
    rig: bool, result: Array,
) -> None:  # fmt: skip
    """Gradients for ``late`` (18, N) at the end of a tape: ``result`` (EVERY, N) to the state at its beginning, the openings,
    and with ``rig`` the parameters; ``by_force`` (K, 2, N) to the samples of the force."""
    points, u, f = np.empty((STAGES, at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, dx, g = np.empty((at.PARAMETERS, BLOCK)), np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK))
    x, lam, sums = np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK)), np.empty((at.STATES, BLOCK))
    trial = np.empty((at.STATES, BLOCK))
    out, total = np.empty((EVERY, BLOCK)), np.empty((EVERY, BLOCK))
    for first in range(0, late.shape[1], BLOCK):
        n = min(BLOCK, late.shape[1] - first)
        load(command, first, n, u)
        load(parameters, first, n, p)
        load(late, first, n, lam)
        total[:], out[:] = 0.0, 0.0
        for k in range(tape.shape[0] - 1, -1, -1):
            load(tape[k], first, n, points[0])
            load(forces[k // steps], first, n, f)
            lay_out(points, u, f, p, 1, step, x, dx, sums, trial, n)
            if rig:
                back_over(adjoint_rig, points, u, f, p, 1, step, lam, x, g, out, total, n)
            else:
                back_over(adjoint, points, u, f, p, 1, step, lam, x, g, out[:INPUTS], total[:INPUTS], n)
            dynamics.settle(lam, n)
            if k % steps == 0:
                store(total[INPUTS - 2 : INPUTS], first, n, by_force[k // steps])
                total[INPUTS - 2 : INPUTS] = 0.0
        dynamics.copy(lam, total, n)
        store(total, first, n, result)


class Terms(NamedTuple):
    """What openings, force and parameters add to the rates of D tangents.

    Of M terms, ``places`` (M, 4): entry of ``ENTRIES``, rate, source, tangent; those of tangent d end before ``ends[d]`` (D,).
    """

    places: NDArray[np.int64]
    ends: NDArray[np.int64]


def terms_of(along: NDArray[np.bool_]) -> Terms:
    """The terms of tangents (D, EVERY) that are True where they are not zero."""
    others = [(k, rate, source) for k, (rate, source) in enumerate(ENTRIES) if source >= at.STATES]
    places = [(*other, d) for d, one in enumerate(along) for other in others if one[other[2]]]
    found = np.array(places, dtype=np.int64).reshape(-1, 4)
    return Terms(found, np.searchsorted(found[:, 3], np.arange(len(along)), side="right"))


@helper
def load_whole(source: Array, first: int, n: int, scratch: Array) -> int:
    """``load`` of whole vectors; returns their lanes, at most ``SPAN``."""
    whole = -(-n // VECTOR) * VECTOR
    for row in range(source.shape[0]):
        for i in range(whole):
            scratch[row, i] = source[row, first + min(i, n - 1)]
    return whole


@helper
def integrate_tangents(
    x: Array, u: Array, f: Array, p: Array, s: Array, places: NDArray[np.int64], ends: NDArray[np.int64], seeds: Array,
    steps: int, step: float, j: Array, out: Array, total: Array, trial: Array, late: Array, moved: Array, n: int,
) -> None:  # fmt: skip
    """``dynamics.integrate`` of a state ``x`` (18, n) and of its tangents ``s`` (D, 18, n).

    ``seeds`` (M, n) are the tangents of the sources of ``Terms``. Scratch: ``j`` (SLOPES + 18, n), ``out``, ``total``,
    ``trial`` (18, n), ``late``, ``moved`` (D, 18, n).
    """
    rig = False
    for m in range(len(places)):
        rig = rig or places[m, 2] >= INPUTS
    for _ in range(steps):
        dynamics.copy(x, total, n)
        dynamics.copy(x, trial, n)
        for d in range(s.shape[0]):
            dynamics.copy(s[d], late[d], n)
            dynamics.copy(s[d], moved[d], n)
        for stage in range(STAGES):
            weight, ahead = weight_of(stage, step), ahead_of(stage, step)
            slopes(trial, u, f, p, j, n)
            if rig:
                slopes_rig(trial, u, f, p, j, n)
            dynamics.stage(x, j[SLOPES:], total, trial, n, weight, ahead)
            first = 0
            for d in range(s.shape[0]):
                carry(j, moved[d], out, n)
                for m in range(first, ends[d]):
                    for i in range(n):
                        out[places[m, 1], i] += j[places[m, 0], i] * seeds[m, i]
                first = ends[d]
                dynamics.stage(s[d], out, late[d], moved[d], n, weight, ahead)
        dynamics.copy(total, x, n)
        for d in range(s.shape[0]):
            dynamics.copy(late[d], s[d], n)


@kernel
def advance_tangents(
    state: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, along: Array, by_force: Array,
    places: NDArray[np.int64], ends: NDArray[np.int64],
) -> None:  # fmt: skip
    """Integrates ``state`` (18, N) as ``dynamics.advance`` and, in their first 18 rows, its tangents ``along`` (D, EVERY, N).

    The other rows are tangents of openings, force and rig, and ``by_force`` (K, D, 2, N) those of the force's samples;
    ``places`` and ``ends`` are of ``Terms``.
    """
    x, u, f = np.empty((at.STATES, SPAN)), np.empty((4, SPAN)), np.empty((2, SPAN))
    p, j, out = np.empty((at.PARAMETERS, SPAN)), np.empty((SLOPES + at.STATES, SPAN)), np.empty((at.STATES, SPAN))
    total, trial, seeds = np.empty((at.STATES, SPAN)), np.empty((at.STATES, SPAN)), np.empty((len(places), SPAN))
    count = len(along)
    s, late = np.empty((count, at.STATES, SPAN)), np.empty((count, at.STATES, SPAN))
    moved = np.empty((count, at.STATES, SPAN))
    for first in range(0, state.shape[1], SPAN):
        n = min(SPAN, state.shape[1] - first)
        whole = load_whole(state, first, n, x)
        load_whole(command, first, n, u)
        load_whole(parameters, first, n, p)
        for d in range(count):
            load_whole(along[d, : at.STATES], first, n, s[d])
        for k in range(forces.shape[0]):
            load_whole(forces[k], first, n, f)
            for m in range(len(places)):
                source, d = places[m, 2], places[m, 3]
                of_hand = INPUTS - 2 <= source < INPUTS
                for i in range(whole):
                    lane = first + min(i, n - 1)
                    seeds[m, i] = by_force[k, d, source - INPUTS + 2, lane] if of_hand else along[d, source, lane]
            integrate_tangents(
                x, u, f, p, s, places, ends, seeds, steps, step, j, out, total, trial, late, moved, whole
            )  # fmt: skip
        dynamics.settle(x, n)
        store(x, first, n, state)
        for d in range(count):
            store(s[d], first, n, along[d, : at.STATES])
