"""A log beside rigs: their models begun anew in every window and in free run, the worst windows, and which rig is nearest.

Windows are those of an identification: each begins in the state that fits its measurements best, and what cells, tracker and
encoders may add, within what the rig's file knows of them (``KNOWN``), is taken off, and so is the part of a row by which a
board shows positions late. What is left is the model's error,
and noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from baselines.identification.comparing.doing import doings
from baselines.identification.comparing.free_run import Ahead, FreeRun, ahead, followed, free_run, limits_of
from baselines.identification.comparing.ranking import Place, ranked
from baselines.identification.comparing.signals import Signal, SignalError, Track, error_of, scores_of, signals_of
from baselines.identification.fit.problem import Problem, Tick
from baselines.identification.log.log_columns import CHAMBERS
from baselines.identification.log.trial import Trial
from baselines.identification.windows.noise import guessed_noise
from baselines.identification.windows.starts import Noise, settle, states_of
from baselines.identification.windows.windows import LENGTH, Windows, check_begins, cut
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of

WORST = 5
"""Windows that are named."""

MULTIPLE, HORIZON = 10.0, 2.0
"""Times the noise at which a free run has left the log, and s for which runs are followed; assumed. Of white noise alone one
sample in 1e23 is so large."""

KNOWN = 2.0
"""Standard deviations of what a rig's file knows of an error of a sensor, up to which that is taken off. An identification has
no such limit: it names a cell that is further off. Here a wrong mass would hide in wrong cells."""

ROUNDING = 1e-6


@dataclass(frozen=True)
class Candidate:
    """A ``rig`` by its ``name``, and the ``trial`` as a log is read for it."""

    name: str
    rig: Parameters
    trial: Trial


@dataclass(frozen=True)
class Judging:
    """How a log is compared: windows of ``window``, s; limits of a free run, ``multiple`` times the noise or ``pressure``, Pa,
    and ``position``, m; runs are followed for ``horizon``, s."""

    window: float = LENGTH
    multiple: float = MULTIPLE
    pressure: float | None = None
    position: float | None = None
    horizon: float = HORIZON


@dataclass(frozen=True)
class Taken:
    """What was taken off as errors of sensors: ``biases`` of the cells (4,), Pa; ``zeros`` of encoders (2,), m, empty without
    any; ``distortion`` of a tracker, RMS of one axis, m. Positions are ``late`` by so many s more than the rig's latency, which
    is part of a row."""

    biases: Array
    zeros: Array
    distortion: float
    late: float

    def full(self, rig: Parameters) -> list[str]:
        """Errors that were taken off up to their limit and may be larger, a line for each kind of sensor."""
        board, topology = rig.electronics, rig.linkage.topology
        kinds = {
            f"electronics.pressure_bias = {board.pressure_bias:g} Pa": [
                f"{topology.name_of(f'pressures_{CHAMBERS[k]}')} {self.biases[k]:+.4g} Pa"
                for k in topology.chambers
                if _is_full(self.biases[k], board.pressure_bias)
            ],
            f"electronics.encoder_offset = {1e3 * board.encoder_offset:g} mm": [
                f"encoder of cylinder {k + 1} {1e3 * zero:+.4g} mm"
                for k, zero in enumerate(self.zeros)
                if k in topology.cylinders and _is_full(zero, board.encoder_offset)
            ],
            f"electronics.position_distortion = {1e3 * board.position_distortion:g} mm": [
                f"distortion of the tracker {1e3 * size:.4g} mm"
                for size in (self.distortion,)
                if _is_full(size, board.position_distortion)
            ],
        }
        return [
            f"taken off as errors of the sensors, as much as {known} lets them be: {', '.join(found)}; the rest is error"
            for known, found in kinds.items()
            if found
        ]


def _is_full(size: float, known: float) -> bool:
    """Whether an error of a sensor is as large as what is ``known`` of it allows."""
    return bool(known) and abs(size) > (1.0 - ROUNDING) * KNOWN * known


@dataclass(frozen=True)
class Worst:
    """A window from ``start`` to ``end``, s of the log, with its error ``over_noise``; most of it is in a ``signal``, whose RMS
    there is ``rms``. ``does`` says what the rig does."""

    start: float
    end: float
    over_noise: float
    signal: Signal
    rms: float
    does: tuple[str, ...]


@dataclass(frozen=True)
class Doing:
    """The error over the noise, of ``pressures`` and ``positions``, in the ``count`` windows in which the rig does ``what``."""

    what: str
    count: int
    pressures: float
    positions: float


@dataclass(frozen=True)
class Compared:
    """One rig beside the log.

    ``tracks`` and ``errors`` are of the windows, begun anew at ``starts`` (W,), s, with ``scores`` (W,), mean squares over the
    noise; ``worst`` first the worst. ``doings`` say where errors arise. ``free`` is the free run, ``ahead`` how far
    it predicts.
    What was ``taken`` off as errors of sensors is in no error.
    """

    name: str
    rig: Parameters
    starts: Array
    tracks: tuple[Track, ...]
    errors: tuple[SignalError, ...]
    scores: Array
    worst: tuple[Worst, ...]
    doings: tuple[Doing, ...]
    free: FreeRun
    ahead: tuple[Ahead, ...]
    taken: Taken

    @property
    def error(self) -> float:
        """RMS over windows and signals of the error over the noise."""
        return float(np.sqrt(np.mean(self.scores)))


@dataclass(frozen=True)
class Comparison:
    """Rigs beside a log.

    Parameters
    ----------
    rigs : tuple of Compared
        One per rig, as given: ``errors`` per signal with ``rms``, ``largest``, ``at``, ``share`` of the motion and
        ``over_noise``, of windows; ``worst`` windows; ``doings``; ``free``, the free run with its ``errors`` and ``leaves``;
        ``ahead``, how far it predicts.
    places : tuple of Place
        The rigs by their error, the nearest first, each with the 95 % interval of what its error is more than the first one's.
    signals : tuple of Signal
        The log's signals, with their noise and motion.
    window : float
        s of a window.
    limits : dict
        The limit of each signal, beyond which a free run has left the log.
    notes : tuple of str
        What of the log was left out, a line each.
    trial : Trial
        The log, as it was read for the first rig.

    Examples
    --------
    ``compare`` returns one; its docstring makes a log first, with which

    >>> import birthsim
    >>> found = birthsim.compare("log.csv", ["before.toml", "after.toml"])  # doctest: +SKIP
    >>> found.places[0].name  # doctest: +SKIP
    'after.toml'
    """

    rigs: tuple[Compared, ...]
    places: tuple[Place, ...]
    signals: tuple[Signal, ...]
    window: float
    limits: dict[str, float]
    notes: tuple[str, ...]
    trial: Trial

    @property
    def nearest(self) -> Compared:
        """The rig with the least error."""
        return next(one for one in self.rigs if one.name == self.places[0].name)


def compare(candidates: Sequence[Candidate], judging: Judging = Judging(), tick: Tick = lambda: None) -> Comparison:
    """Rigs beside a log, in the windows that all of them share; ``tick`` is called once a rig.

    ``ValueError`` for rigs of unlike ``linkage.kind``, and for those whose model cannot follow the log at all.
    """
    first = candidates[0]
    for one in candidates:
        check_begins(one.rig, "a comparison")
        if one.rig.linkage.kind != first.rig.linkage.kind:
            kinds = ", ".join(f"{other.rig.linkage.kind} ({other.name})" for other in (first, one))
            raise ValueError(f"linkage.kind = {kinds}; allowed: rigs of one kind")
    every = [cut(one.trial, one.rig, judging.window) for one in candidates]
    shared = reduce(np.intersect1d, [windows.starts for windows in every])
    signals, noise = signals_of(first.trial, first.rig), guessed_noise(first.trial)
    limits = limits_of(signals, judging.multiple, judging.pressure, judging.position)
    found = [
        _compared(one, windows.some(np.isin(windows.starts, shared)), noise, signals, limits, judging, tick)
        for one, windows in zip(candidates, every, strict=True)
    ]
    places = ranked({one.name: one.scores for one in found})
    notes = tuple(dict.fromkeys(note for one in candidates for note in one.trial.notes))
    return Comparison(tuple(found), places, signals, every[0].length * first.trial.period, limits, notes, first.trial)


def _compared(
    one: Candidate,
    windows: Windows,
    noise: Noise,
    signals: tuple[Signal, ...],
    limits: dict[str, float],
    judging: Judging,
    tick: Tick,
) -> Compared:
    rig, windows, taken = begun(one, windows, noise, tick)
    tracks = followed(windows, rig, signals)
    scores = scores_of(tracks)
    does = doings(windows, rig)
    times = windows.trial.times
    off = np.array([np.nan_to_num(track.off / track.signal.noise) for track in tracks])
    worst = []
    for w in np.argsort(scores, kind="stable")[::-1][:WORST]:
        most = int(np.argmax(off[:, w]))
        first = int(windows.starts[w])
        worst.append(
            Worst(
                float(times[first]),
                float(times[first + windows.length]),
                float(np.sqrt(scores[w])),
                tracks[most].signal,
                float(tracks[most].off[w]),
                tuple(name for name, there in does.items() if there[w]),
            )
        )
    parts = [
        Doing(name, int(there.sum()), *(_over_noise(tracks, unit, there) for unit in ("Pa", "m")))
        for name, there in {"all": np.ones(len(scores), dtype=np.bool_), **does}.items()
        if there.any()
    ]
    return Compared(
        one.name,
        one.rig,
        times[windows.starts],
        tracks,
        tuple(map(error_of, tracks)),
        scores,
        tuple(worst),
        tuple(parts),
        free_run(windows, rig, signals, limits),
        ahead(windows, rig, signals, limits, judging.horizon),
        taken,
    )


def begun(one: Candidate, windows: Windows, noise: Noise, tick: Tick = lambda: None) -> tuple[Parameters, Windows, Taken]:
    """The rig with the latency that the log's rows show, the windows without what sensors add, whose ``state`` is the one that
    fits it best, and what was taken off: an identification's ``Problem`` in which nothing of the rig is free."""
    shown = [as_rows_show(one.rig, windows.trial, part) for part in (0.0, 0.5, 1.0)]
    problem = Problem(windows, noise, shown[1], (), tick)
    offsets = problem.offsets
    with problem.explained():
        problem.begin_anew(shown[1], offsets.sizes)
        free, residual = problem.settled(np.empty(0))
        if not np.isfinite(residual).all():
            raise ValueError(f"parameters = {one.name}: {problem.disagreement()}")
        offsets.bound(KNOWN)
        corrected = offsets.corrected()
        costs = [float(np.sum(settle(corrected, noise, rig, free, None)[1] ** 2)) for rig in shown]
        rig = as_rows_show(one.rig, windows.trial, lowest(*costs))
        free, _ = settle(corrected, noise, rig, free, None)
    start = states_of(windows, [rig], free[None])[:, 0]
    windows = replace(corrected, state=start, stiffness=rig.friction.bristle_stiffness)
    late = windows.latency_of(rig) - windows.latency_of(one.rig)
    return rig, windows, Taken(offsets.biases, offsets.zeros, offsets.distortion, late)


def as_rows_show(rig: Parameters, trial: Trial, part: float) -> Parameters:
    """A rig whose positions are later by a ``part`` of a row: a board that looks once a row shows a sample up to a row late."""
    most = DECLARED[trial.latency].most
    return rig.replace({trial.latency: min(value_of(rig, trial.latency) + part * trial.period, most)})


def lowest(first: float, middle: float, last: float) -> float:
    """Where, from 0 to 1, a parabola is lowest that has these values at 0, a half and 1."""
    bend = first - 2.0 * middle + last
    if bend > 0:
        return float(np.clip(0.5 + 0.25 * (first - last) / bend, 0.0, 1.0))
    return 0.0 if first < last else 1.0


def _over_noise(tracks: tuple[Track, ...], unit: str, there: NDArray[np.bool_]) -> float:
    """RMS over the noise of the signals with a ``unit``, in some windows (W,)."""
    return float(np.sqrt(np.mean(scores_of(tuple(one for one in tracks if one.signal.unit == unit))[there])))
