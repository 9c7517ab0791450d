"""Predictions of the windows of a trial: every window under every set of parameters, side by side as lanes of the plant."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from baselines.identification.windows import Windows, admitted_openings, spools_at
from birthsim_env.loop.world import Clock
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.dynamics import integrate, load, settle, steps_in, store
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.rig.parameters import Parameters

LANES = 4096
"""Lanes at once; more only take memory."""


def predict(windows: Windows, rigs: Sequence[Parameters], states: Array) -> tuple[Array, Array, Array]:
    """Pressures (V, W, K, 4), Pa, positions (V, W, F, 2), m, and states at the end (18, V, W), for V ``rigs``.

    ``states`` (18, V, W) are those in which the windows begin; their spools are replaced by what the openings before the
    window have made of them. A position that arrives at a time was taken ``position_latency`` earlier. The limit of the
    valves is that of the first rig.
    """
    count, trial = len(windows.starts), windows.trial
    windows.budget.spend(count * len(rigs) * windows.length * trial.period)
    columns = np.array([parameter_column(rig) for rig in rigs]).T
    late = np.array([rig.electronics.position_latency for rig in rigs]) / trial.period
    states, openings = states.copy(), admitted_openings(trial, columns[:, 0])
    for rate in np.unique(columns[at.SPOOL_RATE]):
        lanes = np.flatnonzero(columns[at.SPOOL_RATE] == rate)
        states[np.ix_(np.array(at.SPOOLS), lanes)] = spools_at(openings, trial.period, windows.starts, float(rate))[:, None]
    pressures = np.empty((len(rigs), count, windows.length, 4))
    positions = np.empty((len(rigs), count, *windows.positions.shape[1:]))
    at_once = max(1, LANES // count)
    clock = Clock(Clock.numbers(period=trial.period, steps=steps_in(trial.period)))
    for first in range(0, len(rigs), at_once):
        part = slice(first, first + at_once)
        moved = states[:, part].reshape(at.STATES, -1)
        some = moved.shape[1] // count
        tracks = np.empty((windows.length + 1, 6, moved.shape[1]))
        rows = np.tile(windows.starts, some).astype(np.int64)
        parameters = np.repeat(columns[:, part], count, axis=1)
        _track(moved, openings, trial.forces, rows, parameters, clock, tracks)
        states[:, part] = moved.reshape(at.STATES, some, count)
        shaped = tracks.reshape(windows.length + 1, 6, some, count)
        pressures[part] = shaped[:-1, :4].transpose(2, 3, 0, 1)
        positions[part] = _shown(windows, shaped[:, 4:], late[part])
    return pressures, positions, states


@kernel
def _track(
    state: Array, openings: Array, forces: Array, rows: NDArray[np.int64], parameters: Array, clock: Clock, tracks: Array
) -> None:
    """Moves ``state`` (18, N) by K periods of a ``clock``, under openings (4, T) and forces (2, T) from
    ``rows`` (N,) on; writes pressures and position of the end effector at every period, ``tracks`` (K + 1, 6, N)."""
    x, u, f = np.empty((at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, hit, motion = np.empty((at.PARAMETERS, BLOCK)), np.zeros((2, BLOCK)), np.empty((4, BLOCK))
    periods, steps = tracks.shape[0] - 1, int(clock.steps)
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(parameters, first, n, p)
        for k in range(periods + 1):
            end_effector_motion(x[:, :n], p[:, :n], motion[:, :n])
            for i in range(n):
                for chamber in range(4):
                    tracks[k, chamber, first + i] = x[at.PRESSURES[chamber], i]
                for axis in range(2):
                    tracks[k, 4 + axis, first + i] = motion[axis, i]
            if k < periods:
                for i in range(n):
                    row = rows[first + i] + k
                    for valve in range(4):
                        u[valve, i] = openings[valve, row]
                    for axis in range(2):
                        f[axis, i] = forces[axis, row]
                integrate(x, u, f, p, steps, clock.period / steps, hit, n)
                settle(x, n)
        store(x, first, n, state)


def _shown(windows: Windows, tracks: Array, late: Array) -> Array:
    """Positions (V, W, F, 2) that arrive: of tracks (K + 1, 2, V, W), ``late`` (V,) periods earlier, straight in between."""
    when = windows.arrived - late[:, None, None]
    before = np.clip(np.floor(when), 0, windows.length - 1).astype(np.intp)
    part = (when - before)[..., None]
    variant, window = np.arange(len(late))[:, None, None], np.arange(len(windows.starts))[:, None]
    low, high = (tracks[before + one, :, variant, window] for one in (0, 1))
    return np.asarray(low + part * (high - low))
