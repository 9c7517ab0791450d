"""Whether the times of a user's rows fall into the episode, and in which unit they seem to be where they do not."""

import warnings
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import shown

MANY = 20
"""Rows from which a table counts as recorded, not as written by hand."""

LONG, COARSE = 50.0, 0.5
"""Episodes that a table may last, and s between its rows, before its unit is doubted: seconds that are ms last 1000 times as
long, and nobody records more often than every 0.5 ms for an episode."""

LITTLE = 0.02
"""Part of the episode below which recorded rows are too short for it; minutes would be a sixtieth."""

ROUNDING = 1e-9
"""s before zero that still are zero."""

EPOCH = 1e8, 1e10
"""s since 1970 that are taken for a date: 1973 to 2286."""

UNITS = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
LONGER = {"min": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Timed:
    """When a part does something: the times of a user's ``rows`` (M,), s, none where there are no rows, and the time, s, until
    which nothing ``changes``."""

    rows: Array
    changes: float


def timed(times: Array, values: Array) -> Timed:
    """``Timed`` of rows: ``values`` (M, C) at ``times`` (M,), s."""
    moved = np.flatnonzero((values != values[0]).any(axis=1))
    return Timed(times, float(times[moved[0] - 1] if len(moved) else times[0]))


def called(name: str, given: Any) -> str:
    """An argument in an error: its name, and the file that it names, if it does."""
    return f"{name} = {shown(str(given))}" if isinstance(given, (str, PathLike)) else name


def check_times(name: str, given: Any, found: Any, duration: float, usual: bool) -> None:
    """What a part does must fall into an episode of ``duration`` s: ``ValueError`` where nothing does, and a warning with the
    share where little does.

    ``name`` is the argument, ``given`` what the user gave for it, ``found`` when the part made of it does something. Rows that
    begin with the episode and go on after it are in order, and where the duration is not the ``usual`` one of a scenario, they
    may change nothing before its end. Where nothing is given, a scenario's own part may begin after a short duration.
    """
    if given is None or not isinstance(found, Timed):  # a user's class may call anything so
        return
    said, rows, episode = called(name, given), found.rows, f"the episode, 0 to {duration:g} s"
    if len(rows) == 0:
        if found.changes >= duration:
            guess = unit_of(np.array([found.changes]), duration)
            raise ValueError(f"{said} begins at {found.changes:.10g} s{guess}; allowed: within {episode}, or a longer duration")
        return
    first, last, count = rows[0], rows[-1], len(rows)
    guess = unit_of(rows, duration)
    if first >= duration or last < 0.0 or (last == 0.0 and count > 1):
        times = f"{first:.10g}" if count == 1 else f"{first:.10g} to {last:.10g}"
        raise ValueError(
            f"{said}: nothing of it falls into {episode}: its times are {times} s{guess}; allowed: seconds since the episode "
            "begins"
        )
    if problem := _little(rows, found.changes if usual else first, duration):
        warnings.warn(f"{said}: {problem}, 0 to {duration:g} s{guess}", stacklevel=2)


def _little(rows: Array, changes: float, duration: float) -> str:
    """In words what of the rows or of the episode goes to waste; nothing where all is as it should be."""
    first, last, count = rows[0], rows[-1], len(rows)
    inside = int(((rows >= -ROUNDING) & (rows <= duration)).sum())
    if first < -ROUNDING:
        before = int((rows < -ROUNDING).sum())
        return f"{before} of {count} rows ({100 * before / count:.3g} %) lie before the episode"
    if first > 0.5 * duration:
        return f"its first row is at {first:.6g} s, after {100 * first / duration:.3g} % of the episode"
    if changes >= duration:
        return f"its first change begins at {changes:.6g} s, so that 0 % of its changes fall into the episode"
    if last > LONG * duration and np.median(np.diff(rows)) >= COARSE:
        return f"{inside} of {count} rows, {100 * duration / last:.2g} % of its {last:.6g} s, fall into the episode"
    if count >= MANY and last - first < LITTLE * duration:
        return f"its {count} rows last {last - first:.3g} s, {100 * (last - first) / duration:.2g} % of the episode"
    return ""


def unit_of(times: Array, duration: float) -> str:
    """The unit in which ``times`` (M,), increasing, seem to be instead of s, for an episode of ``duration`` s: words for the
    end of a message, none where there is no better unit."""
    first, span = float(times[0]), float(times[-1] - times[0])
    for unit, second in {"s": 1.0, **UNITS}.items():
        if EPOCH[0] <= first * second < EPOCH[1]:
            into = "" if unit == "s" else f" and convert {unit} to s"
            return f", which looks like {unit} since 1970: subtract the first{into}"
    step = float(np.median(np.diff(times))) if len(times) > 1 else first
    reach = max(abs(first), abs(float(times[-1])))
    for unit, second in UNITS.items():
        if reach > LONG * duration and step >= COARSE and reach * second <= LONG * duration:
            return f", which looks like {unit}"
    if len(times) >= MANY and span < LITTLE * duration:
        for unit, second in LONGER.items():
            if 0.5 * duration <= span * second <= 2.0 * duration:
                return f", which looks like {unit}"
    return ": subtract the first" if first >= duration and span > 0.0 else ""
