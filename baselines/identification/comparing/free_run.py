"""A model that runs beside a log: it begins in the log's state, and only openings and forces enter after that.

Positions of an open-loop pneumatic rig drift, because nothing holds a piston but friction. A free run is therefore judged by
when it leaves the log: the first time at which a signal's error is beyond its limit.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from baselines.identification.comparing.signals import Signal, SignalError, Track, error_of, tracks_of
from baselines.identification.fit.budget import Budget
from baselines.identification.log.trial import Trial
from baselines.identification.windows.prediction import predict
from baselines.identification.windows.windows import Windows, windows_at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

RUNS = 64
"""Runs of which the time to the limit is taken, all over the log; assumed."""

QUANTILES = (0.1, 0.5, 0.9)


@dataclass(frozen=True)
class Leaving:
    """A ``signal`` is first beyond its ``limit`` ``at`` a time of the log, ``after`` so many s of free run; infinite where it
    stays within."""

    signal: Signal
    limit: float
    at: float
    after: float


@dataclass(frozen=True)
class FreeRun:
    """One free run from ``start`` to ``end``, s of the log, which ends ``at_gap`` where the log lacks openings or forces."""

    start: float
    end: float
    at_gap: bool
    tracks: tuple[Track, ...]
    errors: tuple[SignalError, ...]
    leaves: tuple[Leaving, ...]


@dataclass(frozen=True)
class Ahead:
    """How far ahead a ``signal`` is predicted within its ``limit``, s: 10 %, half and 90 % of ``runs`` stay within it for less
    than ``after`` (3,); infinite beyond the ``horizon`` to which they were followed."""

    signal: Signal
    limit: float
    after: tuple[float, float, float]
    horizon: float
    runs: int


def limits_of(
    signals: tuple[Signal, ...], multiple: float, pressure: float | None = None, position: float | None = None
) -> dict[str, float]:
    """The limit of each signal: ``multiple`` times its noise, or ``pressure``, Pa, and ``position``, m, where given."""
    given = {"Pa": pressure, "m": position}
    absolute = {signal.name: given[signal.unit] for signal in signals}
    return {signal.name: multiple * signal.noise if (limit := absolute[signal.name]) is None else limit for signal in signals}


def judged(windows: Windows) -> tuple[Trial, NDArray[np.intp]]:
    """The trial as ``windows`` have it, NaN where none of them measures, and the rows at which its positions arrive."""
    trial = windows.trial
    pressures, positions = np.full_like(trial.pressures, np.nan), np.full_like(trial.positions, np.nan)
    rows = windows.starts[:, None] + np.arange(windows.length)
    heard = np.where(windows.pressure_weights > 0, windows.pressures, np.nan)
    pressures[:, rows] = heard.transpose(2, 0, 1)
    fresh = (windows.starts[:, None] + windows.arrived)[windows.valid]
    positions[:, fresh] = windows.positions[windows.valid].T
    return replace(trial, pressures=pressures, positions=positions), np.unique(fresh)


def runs_on(windows: Windows, rig: Parameters, chosen: NDArray[np.intp], length: int) -> Windows:
    """Windows of ``length`` rows that begin where those that are ``chosen`` (R,) do."""
    trial, fresh = judged(windows)
    return windows_at(trial, rig, windows.starts[chosen], length, fresh, windows.state[:, chosen], Budget.endless())


def followed(windows: Windows, rig: Parameters, signals: tuple[Signal, ...]) -> tuple[Track, ...]:
    """The model in free run through windows, from their ``state``."""
    pressures, positions, _ = predict(windows, [rig], windows.state[:, None])
    return tracks_of(windows, rig, signals, pressures[0], positions[0])


def rows_ahead(trial: Trial) -> NDArray[np.intp]:
    """For each row (T,) of a trial how many rows can be run from it on, up to where openings or forces are not known."""
    count = len(trial.times)
    if trial.unknown is None or not trial.unknown.any():
        return np.arange(count)[::-1].astype(np.intp)
    lost = np.flatnonzero(trial.unknown)
    following = np.append(lost, count - 1)[np.searchsorted(lost, np.arange(count))]
    return np.asarray(np.minimum(following, count - 1) - np.arange(count), dtype=np.intp)


def first_beyond(track: Track, limit: float, starts: Array) -> tuple[Array, Array]:
    """When each window (W,) is first beyond a limit: s of the log, and s after its start (W,); infinite where it is not."""
    beyond = np.isfinite(track.measured) & ~(np.abs(track.error) <= limit)
    first = np.argmax(beyond, axis=1)
    at = np.where(beyond.any(axis=1), track.times[np.arange(len(first)), first], np.inf)
    return at, at - starts


def free_run(windows: Windows, rig: Parameters, signals: tuple[Signal, ...], limits: Mapping[str, float]) -> FreeRun:
    """The free run through the whole log, or through its longest stretch without a gap in openings or forces."""
    trial, lengths = windows.trial, rows_ahead(windows.trial)[windows.starts]
    chosen = np.array([np.argmax(lengths)])
    first, length = int(windows.starts[chosen[0]]), int(lengths[chosen[0]])
    long = runs_on(windows, rig, chosen, length)
    tracks, start = followed(long, rig, signals), trial.times[[first]]
    leaves = []
    for track in tracks:
        limit = limits[track.signal.name]
        at, after = first_beyond(track, limit, start)
        leaves.append(Leaving(track.signal, limit, float(at[0]), float(after[0])))
    end, at_gap = float(trial.times[first + length]), first + length < len(trial.times) - 1
    return FreeRun(float(start[0]), end, at_gap, tracks, tuple(map(error_of, tracks)), tuple(leaves))


def ahead(
    windows: Windows,
    rig: Parameters,
    signals: tuple[Signal, ...],
    limits: Mapping[str, float],
    horizon: float,
) -> tuple[Ahead, ...]:
    """How far ahead the model predicts, from windows all over the log that are followed for ``horizon``, s, or half of the log
    where that is shorter; nothing where gaps leave no stretch so long."""
    trial = windows.trial
    length = min(round(horizon / trial.period), (len(trial.times) - int(windows.starts[0])) // 2)
    able = np.flatnonzero(rows_ahead(trial)[windows.starts] >= length)
    if not len(able):
        return ()
    chosen = able[np.unique(np.linspace(0, len(able) - 1, min(RUNS, len(able))).round().astype(np.intp))]
    long = runs_on(windows, rig, chosen, length)
    found = []
    for track in followed(long, rig, signals):
        limit = limits[track.signal.name]
        _, after = first_beyond(track, limit, trial.times[long.starts])
        low, middle, high = (float(np.quantile(after, q, method="inverted_cdf")) for q in QUANTILES)
        found.append(Ahead(track.signal, limit, (low, middle, high), length * trial.period, len(chosen)))
    return tuple(found)
