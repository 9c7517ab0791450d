"""Predictions of the windows of a trial: every window under every set of parameters, side by side as lanes of the plant."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from baselines.identification.windows.tracks import begin_options, track, track_options
from baselines.identification.windows.windows import Windows, admitted_openings, spools_at
from birthsim_env.loop.world import Clock
from birthsim_env.physics import options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.dynamics import steps_in
from birthsim_env.physics.rig.parameters import Parameters

LANES = 4096
"""Lanes at once; more only take memory."""

SLOWER = 3.0
"""Times that a second of a rig with options counts; moving it takes eight times as long, and the rest as long as always."""


def predict(windows: Windows, rigs: Sequence[Parameters], states: Array) -> tuple[Array, Array, Array]:
    """Pressures (V, W, K, 4), Pa, positions (V, W, F, 2), m, and states at the end (S, V, W), for V ``rigs``.

    ``states`` (S, V, W) are those in which the windows begin; their spools are replaced by what the openings before the
    window have made of them. A position that arrives at a time was taken a latency earlier.
    """
    count, trial = len(windows.starts), windows.trial
    columns = np.array([parameter_column(rig) for rig in rigs]).T
    plain = options.are_off(columns)
    windows.budget.spend((1.0 if plain else SLOWER) * count * len(rigs) * windows.length * trial.period)
    late = np.array([windows.latency_of(rig) for rig in rigs]) / trial.period
    states = states.copy()
    openings, forces, part_of = _driving(windows, columns, states)
    pressures = np.empty((len(rigs), count, windows.length, 4))
    positions = np.empty((len(rigs), count, *windows.positions.shape[1:]))
    at_once = max(1, LANES // count)
    clock = Clock(Clock.numbers(period=trial.period, steps=steps_in(trial.period)))
    for first in range(0, len(rigs), at_once):
        part = slice(first, first + at_once)
        moved = states[:, part].reshape(len(states), -1)
        some = moved.shape[1] // count
        tracks = np.empty((windows.length + 1, 6, moved.shape[1]))
        rows = (windows.starts + part_of[part, None] * len(trial.times)).ravel().astype(np.int64)
        parameters = np.repeat(columns[:, part], count, axis=1)
        if plain:
            track(moved, openings, forces, rows, parameters, clock, tracks)
        else:
            own, further = moved[: at.STATES].copy(), np.empty((options.FURTHER, moved.shape[1]))
            begin_options(own, parameters, moved[at.STATES :].copy(), further)
            track_options(own, further, openings, forces, rows, parameters, clock, tracks)
            moved[: at.STATES], moved[at.STATES], moved[at.STATES + 1 :] = (
                own,
                further[0],
                further[options.TUBES : options.FLOWS],
            )
        states[:, part] = moved.reshape(len(states), some, count)
        shaped = tracks.reshape(windows.length + 1, 6, some, count)
        pressures[part] = shaped[:-1, :4].transpose(2, 3, 0, 1)
        positions[part] = _shown(windows, shaped[:, 4:], late[part])
    return pressures, positions, states


def _driving(windows: Windows, columns: Array, states: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """What moves rigs with ``columns`` (PARAMETERS, V): openings (4, D T) and forces (2, D T) of the D kinds of valves one
    behind the other, and the kind of each rig (V,). Puts the spools of ``states`` (S, V, W) where they begin."""
    trial = windows.trial
    kinds, part_of = np.unique(columns[[at.PLAY, at.OPENING_LIMIT]], axis=1, return_inverse=True)
    part_of = part_of.ravel().astype(np.intp)
    some = [admitted_openings(trial, columns[:, int(np.argmax(part_of == k))]) for k in range(kinds.shape[1])]
    for k, opened in enumerate(some):
        for rate in np.unique(columns[at.SPOOL_RATE, part_of == k]):
            lanes = np.flatnonzero((columns[at.SPOOL_RATE] == rate) & (part_of == k))
            begun = spools_at(opened, trial.period, windows.starts, float(rate))
            states[np.ix_(np.array(at.SPOOLS), lanes)] = begun[:, None]
    return np.concatenate(some, axis=1), np.tile(trial.forces, len(some)), part_of


def _shown(windows: Windows, tracks: Array, late: Array) -> Array:
    """Positions (V, W, F, 2) that arrive: of tracks (K + 1, 2, V, W), ``late`` (V,) periods earlier, straight in between."""
    when = windows.arrived - late[:, None, None]
    before = np.clip(np.floor(when), 0, windows.length - 1).astype(np.intp)
    part = (when - before)[..., None]
    variant, window = np.arange(len(late))[:, None, None], np.arange(len(windows.starts))[:, None]
    low, high = (tracks[before + one, :, variant, window] for one in (0, 1))
    return np.asarray(low + part * (high - low))
