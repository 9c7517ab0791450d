"""The rows of a log on an even grid: repeated times, times out of order, gaps."""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.lanes import Array

SHORTEST = 2.0
"""s of a log."""

LONGEST_PERIOD, SHORTEST_PERIOD = 0.0101, 0.00024
"""s from row to row: those of control boards, with some room."""

UNEVEN = 0.5
"""Fraction of a period by which a row may be early or late."""

MOST = 0.1
"""Fraction of the rows that may be missing, or be left out of one signal; assumed. A log with more is refused."""

STRAYS = 0.01
"""Fraction of the rows that may lie far before or after all others."""

FARTHEST = 1e9
"""Periods from row to row that are taken for more."""

NAMED = 3
"""Rows that a note names."""


@dataclass(frozen=True)
class Grid:
    """The rows of the log ``source``: ``times`` (T,) evenly spaced; the ``rows`` (N,) of the file that have a place among them,
    and that ``place`` (N,); ``notes`` on the others."""

    source: str
    times: Array
    rows: NDArray[np.intp]
    place: NDArray[np.intp]
    notes: tuple[str, ...] = ()

    @property
    def period(self) -> float:
        """s from row to row."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))

    def spread(self, values: Array) -> Array:
        """Columns (C, rows of the file) on the grid, (C, T), NaN where the file has no row."""
        found = np.full((len(values), len(self.times)), np.nan)
        found[:, self.place] = values[:, self.rows]
        return found

    def where(self, first: int | np.intp, last: int | np.intp) -> str:
        """Places of the grid from ``first`` to before ``last`` in words: rows of the file and times."""
        rows = self.rows[np.searchsorted(self.place, np.array([first, last - 1]))]
        if last - first == 1:
            return f"row {rows[0]} at {self.times[first]:.6g} s"
        return f"rows {rows[0]} to {rows[1]} from {self.times[first]:.6g} to {self.times[last - 1]:.6g} s"


def even_grid(source: str, times: Array) -> Grid:
    """The grid of a file's times. ``ValueError`` names the row where too many are missing, repeated, or out of order."""
    if len(times) < 2:
        raise ValueError(f"{source} has {len(times)} rows; allowed: at least {SHORTEST:g} s of them")
    period = _period(source, times)
    kept = _without_strays(times, _increasing(times), period)
    wrong = np.setdiff1d(np.arange(len(times)), kept)
    if len(wrong) > MOST * len(times):
        back = ~(np.diff(times) > 0)
        row = int(np.argmax(back)) + 1 if back.any() else int(wrong[0])
        before = f" after {times[row - 1]:.9g}" if row else ""
        raise ValueError(
            f"{source}, row {row}: time {times[row]:.9g}{before}, and {len(wrong) - 1} more such rows; "
            "allowed: increasing times"
        )
    if times[kept[-1]] - times[kept[0]] < SHORTEST:
        raise ValueError(f"{source} holds {times[kept[-1]] - times[kept[0]]:.3g} s; allowed: at least {SHORTEST:g} s")
    kept, periods, moved = _whole_periods(kept, np.minimum(np.diff(times[kept]) / period, FARTHEST))
    place = np.concatenate([[0], np.cumsum(periods)])
    missing = int(place[-1]) + 1 - len(kept)
    too_many = missing > MOST * len(times)
    even = np.linspace(times[kept[0]], times[kept[-1]], len(kept) if too_many else int(place[-1]) + 1)
    off = np.zeros(len(kept)) if too_many else np.abs(times[kept] - even[place])
    if too_many or moved > MOST * len(times) or off.max() > 2 * period:
        worst = int(np.argmax(off)) if off.any() and not too_many else int(np.argmax(periods)) + 1
        late = 1e3 * (times[kept[worst]] - times[kept[max(worst - 1, 0)]])
        raise ValueError(
            f"{source}, row {kept[worst]}: {late:.3g} ms after the row before, others {1e3 * period:.3g} ms; allowed: evenly "
            f"spaced rows, up to half a period early or late, of which at most {100 * MOST:g} % are missing"
        )
    rows, place, restored = _with_room(kept, place, len(times))
    grid = Grid(source, even, rows, place)
    return replace(grid, notes=tuple(_notes(grid, times, restored, missing - len(restored))))


def _period(source: str, times: Array) -> float:
    steps = np.diff(times[np.isfinite(times)])
    ahead = steps[steps > 0]
    if len(ahead) < (1 - MOST) * (len(times) - 1):
        row = int(np.argmin(np.nan_to_num(np.diff(times)) > 0)) + 1
        raise ValueError(
            f"{source}, row {row}: time {times[row]:.9g} after {times[row - 1]:.9g}, and {len(times) - 2 - len(ahead)} more "
            "such rows; allowed: increasing times"
        )
    period = float(np.median(ahead))
    if not SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
        units = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
        like = [unit for unit, size in units.items() if SHORTEST_PERIOD <= period * size <= LONGEST_PERIOD]
        guess = f"; it looks like {like[0]}, allowed: s" if like else ""
        words = f"allowed: a row every 0.25 to 10 ms, as often as the valves are commanded{guess}"
        raise ValueError(f"{source} has a row every {period:.4g} s; {words}")
    return period


def _increasing(times: Array) -> NDArray[np.intp]:
    """The most rows (N,) whose times are finite and increase: their longest increasing subsequence."""
    finite = np.flatnonzero(np.isfinite(times))
    if (np.diff(times[finite]) > 0).all():
        return finite
    ends: list[float] = []
    last: list[int] = []
    before = np.full(len(times), -1, dtype=np.intp)
    for row in finite:
        length = bisect_left(ends, times[row])
        if length == len(ends):
            ends.append(0.0)
            last.append(0)
        ends[length], last[length] = float(times[row]), int(row)
        before[row] = last[length - 1] if length else -1
    chain = [last[-1]]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1], dtype=np.intp)


def _without_strays(times: Array, kept: NDArray[np.intp], period: float) -> NDArray[np.intp]:
    """``kept`` without a few rows at either end that are far from all others: times of 0 and of 1e30 increase too."""
    few = max(1, round(STRAYS * len(kept)))
    far = np.diff(times[kept]) > MOST * len(kept) * period
    head, tail = np.flatnonzero(far[:few]), np.flatnonzero(far[-few:])
    first = int(head[-1]) + 1 if len(head) else 0
    last = len(far) - min(few, len(far)) + int(tail[0]) + 1 if len(tail) else len(kept)
    return kept[first:last]


def _whole_periods(kept: NDArray[np.intp], steps: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], int]:
    """Rows (N,) without those at the time of the one before, the whole periods (N - 1,) between them, and how many rows are
    early or late by more than half a period."""
    periods = np.rint(steps).astype(np.intp)
    moved, doubled = 0, []
    for k in np.flatnonzero(periods == 0):
        near = [j for j in (k - 1, k + 1) if 0 <= j < len(periods) and periods[j] >= 2]
        if near:
            periods[near[0]] -= 1
            periods[k] = 1
            moved += 1
        else:
            doubled.append(k)
    return np.delete(kept, np.array(doubled, dtype=np.intp) + 1), np.delete(periods, doubled), moved


def _with_room(
    kept: NDArray[np.intp], place: NDArray[np.intp], count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """``kept`` rows and their places, with those in between whose time is wrong where they have just as many places; these."""
    between, room = np.diff(kept) - 1, np.diff(place) - 1
    rows = [np.arange(kept[k] + 1, kept[k + 1]) for k in np.flatnonzero((between > 0) & (between == room))]
    restored = np.concatenate([np.empty(0, dtype=np.intp), *rows])
    if not len(restored):
        return kept, place, restored
    places = np.full(count, -1, dtype=np.intp)
    places[kept] = place
    before = np.maximum.accumulate(np.where(places >= 0, np.arange(count), 0))
    places[restored] = places[before[restored]] + restored - before[restored]
    found = np.flatnonzero(places >= 0)
    return found, places[found], restored


def _notes(grid: Grid, times: Array, restored: NDArray[np.intp], missing: int) -> Iterator[str]:
    lost = np.setdiff1d(np.arange(len(times)), grid.rows)
    for rows, words in ((restored, "put between the rows around them"), (lost, "left out")):
        if len(rows):
            named = ", ".join(f"row {row} ({times[row]:.9g} s)" for row in rows[:NAMED])
            more = f" and {len(rows) - NAMED} more" if len(rows) > NAMED else ""
            yield f"time is repeated, out of order or not finite: {named}{more}; {words}"
    if missing:
        gaps = np.diff(grid.place)
        wide = np.flatnonzero(gaps > 1)
        named = ", ".join(f"{gaps[k] - 1} after {grid.where(grid.place[k], grid.place[k] + 1)}" for k in wide[:NAMED])
        yield f"{missing} rows are missing: {named}{' ...' if len(wide) > NAMED else ''}; treated as not measured"
