"""Predictions of the windows of a trial: every window under every set of parameters, side by side as lanes of the plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from baselines.identification.windows import Windows, spools_at
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

LANES = 4096
"""Lanes at once; more only take memory."""


def predict(windows: Windows, rigs: Sequence[Parameters], states: Array) -> tuple[Array, Array, Array]:
    """Pressures (V, W, K, 4), Pa, positions (V, W, F, 2), m, and states at the end (18, V, W), for V ``rigs``.

    ``states`` (18, V, W) are those in which the windows begin; their spools are replaced by what the openings before the
    window have made of them. A position that arrives at a time was taken ``position_latency`` earlier.
    """
    count = len(windows.starts)
    columns = np.array([parameter_column(rig) for rig in rigs]).T
    late = np.array([rig.electronics.position_latency for rig in rigs]) / windows.trial.period
    states = states.copy()
    for k, column in enumerate(columns.T):
        states[list(at.SPOOLS), k] = spools_at(windows.trial, windows.starts, column)
    pressures = np.empty((len(rigs), count, windows.length, 4))
    positions = np.empty((len(rigs), count, *windows.positions.shape[1:]))
    at_once = max(1, LANES // count)
    for first in range(0, len(rigs), at_once):
        part = slice(first, first + at_once)
        tracks, states[:, part] = _tracks(windows, columns[:, part], states[:, part])
        pressures[part] = tracks[:-1, :4].transpose(2, 3, 0, 1)
        positions[part] = _shown(windows, tracks[:, 4:], late[part])
    return pressures, positions, states


def _tracks(windows: Windows, columns: Array, states: Array) -> tuple[Array, Array]:
    """Pressures and positions (K + 1, 6, V, W) and the states at the end of lanes (V, W)."""
    variants, count = states.shape[1:]
    lanes, trial = variants * count, windows.trial
    plant = Plant(Parameters(), lanes)
    plant.lane_parameters[:] = np.repeat(columns, count, axis=1)
    plant.state = states.reshape(at.STATES, lanes)
    tracks = np.empty((windows.length + 1, 6, lanes))
    for k in range(windows.length + 1):
        tracks[k, :4], tracks[k, 4:] = plant.pressures, plant.end_effector()[:2]
        if k < windows.length:
            command = np.tile(trial.openings[:, windows.starts + k], variants)
            force = np.tile(trial.forces[:, windows.starts + k], variants)
            plant.advance_unchecked(command, np.ascontiguousarray(force[None]), trial.period)
    return tracks.reshape(windows.length + 1, 6, variants, count), plant.state.reshape(at.STATES, variants, count)


def _shown(windows: Windows, tracks: Array, late: Array) -> Array:
    """Positions (V, W, F, 2) that arrive: of tracks (K + 1, 2, V, W), ``late`` (V,) periods earlier, straight in between."""
    when = windows.arrived - late[:, None, None]
    before = np.clip(np.floor(when), 0, windows.length - 1).astype(np.intp)
    part = (when - before)[..., None]
    variant, window = np.arange(len(late))[:, None, None], np.arange(len(windows.starts))[:, None]
    low, high = (tracks[before + one, :, variant, window] for one in (0, 1))
    return np.asarray(low + part * (high - low))
