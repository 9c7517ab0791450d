"""How predictions of windows follow the start states and the rig: exact derivatives of the Runge-Kutta steps that predict.

A window is a lane, and carries one tangent per free number of its start and per parameter.
"""

import numpy as np
from numpy.typing import NDArray

from baselines.identification.prediction import around, given
from baselines.identification.quantities import LATENCY, Quantity, value_of
from baselines.identification.windows import FREE, Windows, admitted_openings, spools_at
from birthsim_env.loop.signals import Point
from birthsim_env.loop.world import Clock
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.dynamics import copy, settle, steps_in
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.gradients.plant import rig_jacobian
from birthsim_env.physics.gradients.right_hand_side import EVERY, INPUTS, RIG
from birthsim_env.physics.gradients.steps import GENERATED as GENERATED
from birthsim_env.physics.gradients.steps import SLOPES, SPAN, integrate_tangents, load_whole, terms_of
from birthsim_env.physics.rig.parameters import Parameters

PLACES = len(at.PRESSURES)
"""Where positions follow pressures."""


def sensitivities(
    windows: Windows, rig: Parameters, states: Array, quantities: tuple[Quantity, ...] = ()
) -> tuple[Array, Array]:
    """Derivatives of pressures (D, W, K, 4), Pa, and positions (D, W, F, 2), m, as ``predict`` has them for one ``rig``.

    D are the rows ``FREE`` of the start ``states`` (18, W), SI, and then the coordinates of ``quantities``.
    """
    count, trial, column = len(windows.starts), windows.trial, parameter_column(rig)
    openings, by_rig = admitted_openings(trial, column), _by_coordinates(rig, quantities)
    states, tangents = states.copy(), np.zeros((len(FREE) + len(quantities), at.STATES, count))
    spools, by_rate = spools_at(openings, trial.period, windows.starts, float(column[at.SPOOL_RATE]))
    states[list(at.SPOOLS)] = spools
    tangents[np.arange(len(FREE)), FREE] = 1.0
    tangents[len(FREE) :, list(at.SPOOLS)] = by_rig[at.SPOOL_RATE][:, None, None] * by_rate
    seeds = np.zeros((len(tangents), EVERY))
    seeds[len(FREE) :, INPUTS:] = by_rig[list(RIG)].T
    places, ends = terms_of(seeds != 0.0)
    clock = Clock(Clock.numbers(period=trial.period, steps=steps_in(trial.period)))
    tracks, moved = np.empty((windows.length + 1, 2, 1, count)), np.empty((windows.length + 1, 6, *tangents.shape[::2]))
    _track_tangents(
        states, openings, trial.forces, windows.starts.astype(np.int64), column, clock, tangents, places, ends,
        seeds[places[:, 3], places[:, 2]], tracks[:, :, 0], moved,
    )  # fmt: skip
    late = np.full(len(tangents), rig.electronics.position_latency / trial.period)
    low, high, part = around(windows, moved[:, PLACES:], late)
    positions = low + part * (high - low)
    for d, one in enumerate(quantities, len(FREE)):
        if one.name == LATENCY:
            low, high, _ = around(windows, tracks, late[:1])
            positions[d] = (low - high)[0] * one.slope(value_of(rig, LATENCY)) / trial.period
    return moved[:-1, :PLACES].transpose(2, 3, 0, 1), positions


def _by_coordinates(rig: Parameters, quantities: tuple[Quantity, ...]) -> Array:
    """Derivatives of the rows of a rig to coordinates, (PARAMETERS, Q); none of them has the latency."""
    found = np.zeros((at.PARAMETERS, len(quantities)))
    for k, one in enumerate(quantities):
        if one.name != LATENCY:
            found[:, k] = rig_jacobian(rig, (one.name,))[:, 0] * one.slope(value_of(rig, one.name))
    return found


@kernel
def _track_tangents(
    state: Array, openings: Array, forces: Array, rows: NDArray[np.int64], column: Array, clock: Clock, along: Array,
    places: NDArray[np.int64], ends: NDArray[np.int64], by_source: Array, tracks: Array, moved: Array,
) -> None:  # fmt: skip
    """Writes positions of ``prediction._track``, (K + 1, 2, N), and how pressures and positions move with tangents ``along``
    (D, 18, N) of the state, (K + 1, 6, D, N).

    ``by_source`` (M,) are the tangents of the sources of ``places``.
    """
    x, u, f = np.empty((at.STATES, SPAN)), np.empty((4, SPAN)), np.empty((2, SPAN))
    p, j, out = np.empty((at.PARAMETERS, SPAN)), np.empty((SLOPES + at.STATES, SPAN)), np.empty((at.STATES, SPAN))
    total, trial, seeds = np.empty((at.STATES, SPAN)), np.empty((at.STATES, SPAN)), np.empty((len(places), SPAN))
    by_y1, by_y2, count = Point(np.empty((Point.size, SPAN))), Point(np.empty((Point.size, SPAN))), len(along)
    periods, steps = tracks.shape[0] - 1, int(clock.steps)
    s, late = np.empty((count, at.STATES, SPAN)), np.empty((count, at.STATES, SPAN))
    further = np.empty((count, at.STATES, SPAN))
    for row in range(at.PARAMETERS):
        p[row] = column[row]
    for m in range(len(places)):
        seeds[m] = by_source[m]
    for first in range(0, state.shape[1], SPAN):
        n = min(SPAN, state.shape[1] - first)
        whole = load_whole(state, first, n, x)
        for d in range(count):
            load_whole(along[d], first, n, s[d])
        for k in range(periods + 1):
            # The velocity of a piston that alone moves at 1 m/s is a column of the Jacobian.
            copy(x, trial, n)
            for i in range(n):
                trial[at.V1, i], trial[at.V2, i] = 1.0, 0.0
            end_effector_motion(trial[:, :n], p[:, :n], by_y1.rows[:, :n])
            for i in range(n):
                trial[at.V1, i], trial[at.V2, i] = 0.0, 1.0
            end_effector_motion(trial[:, :n], p[:, :n], by_y2.rows[:, :n])
            for axis in range(2):
                for i in range(n):
                    tracks[k, axis, first + i] = by_y1.position[axis, i]
            for d in range(count):
                for i in range(n):
                    for chamber in range(4):
                        moved[k, chamber, d, first + i] = s[d, at.PRESSURES[chamber], i]
                    for axis in range(2):
                        moved[k, PLACES + axis, d, first + i] = (
                            by_y1.velocity[axis, i] * s[d, at.Y1, i] + by_y2.velocity[axis, i] * s[d, at.Y2, i]
                        )
            if k < periods:
                given(openings, forces, rows, first, k, u, f, n)
                for i in range(n, whole):
                    u[:, i], f[:, i] = u[:, n - 1], f[:, n - 1]
                integrate_tangents(
                    x, u, f, p, s, places, ends, seeds, steps, clock.period / steps, j, out, total, trial, late, further, whole
                )  # fmt: skip
                settle(x, whole)
