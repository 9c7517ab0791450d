"""What sensors, cables and loggers do to single rows of a signal: spikes, jumps, samples that stand still, saturation.

Each function tells rows that no rig makes from those of a quick one. Smaller errors are left to the weights of the fit
(``robust``).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from baselines.identification.log.trial import fresh_rows, numbers, runs
from birthsim_env.physics.compiled.lanes import Array

Mask = NDArray[np.bool_]

AROUND, NEAR = 5, 101
"""Rows of the median from which a spike stands out, and of the median size of what stands out usually."""

OUT = 10.0
"""Times the usual size at which a value is a spike; noise alone reaches six."""

STILL = 0.05
"""s for which a signal that stands still has lost its sensor, where others move on."""

CLIPPED = 5
"""Rows or samples at the very end of a signal's range that are taken for saturation."""

FAR, QUICK, NOISE = 3e-3, 50.0, 12.0
"""m, m/s2 and standard deviations of the noise by which a sample may leave its neighbours' line."""

DRIFT, TRIED = 1.0, 3
"""m/s at which the head may move while no sample is good, and samples after a jump that are tried for one that is."""

PASSED = 3e-3
"""m by which a position has moved on while a tracker shows the same."""


def spikes(values: Array, least: float) -> Mask:
    """Rows (T,) of finite ``values`` that stand out of their neighbours by more than ``least`` and than others near do."""
    away = np.abs(values - median_filter(values, AROUND, mode="nearest"))
    usual = median_filter(away, min(NEAR, len(values)), mode="nearest")
    return np.asarray(away > np.maximum(least, OUT * usual))


def standing(values: Array, partner: Array, rows: int, moved: float) -> Mask:
    """Rows (T,) in which a cell repeats one value for ``rows`` rows or more although its ``partner`` moves by ``moved``, or
    although it goes on by as much in one step."""
    found = np.zeros(len(values), dtype=np.bool_)
    for first, last in runs(np.concatenate([[False], np.diff(values) == 0])).T:
        first -= 1
        if last - first >= rows:
            on = last < len(values) and abs(values[last] - values[first]) > moved
            found[first:last] |= on or np.ptp(partner[first:last]) > moved
    return found


def clipped(values: Array, beyond: float) -> Mask:
    """Rows (T,) in which finite ``values`` show an end of their range, ``CLIPPED`` or more in a row, into which they come or
    from which they go so fast that they would be further out by ``beyond``."""
    found = np.zeros(len(values), dtype=np.bool_)
    for end in (values.min(), values.max()):
        for first, last in runs(values == end).T:
            outer = values[max(first - CLIPPED, 0)], values[min(last + CLIPPED, len(values)) - 1]
            speed = max(abs(value - end) for value in outer) / CLIPPED
            found[first:last] |= last - first >= CLIPPED and speed * (last - first) / 2 > beyond
    return found


def strayed(bad: Mask, values: Array, step: float) -> Mask:
    """Those runs of ``bad`` rows (T,) that finite ``values`` (C, T) enter or leave without a jump of more than ``step``: a
    signal that strays out of its range and was not thrown out of it."""
    found = np.zeros_like(bad)
    apart = np.linalg.norm(np.diff(values, axis=1), axis=0)
    for first, last in runs(bad).T:
        entered = first > 0 and apart[first - 1] <= step
        if entered or (last < len(bad) and apart[last - 1] <= step):
            found[first:last] = True
    return found


def samples_of(positions: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows (F,) with the first and each fresh sample of ``positions`` (2, T), and the sample (T,) that each row shows."""
    known = numbers(positions)
    first = int(np.argmax(known))
    rows = np.unique(np.concatenate([[first], fresh_rows(positions)]))
    arrived = np.zeros(positions.shape[1], dtype=np.intp)
    arrived[rows] = 1
    return rows, np.maximum(np.cumsum(arrived) - 1, 0)


def jumps(positions: Array, period: float, noise: float) -> Mask:
    """Rows (T,) whose sample of ``positions`` (2, T), NaN where there is none, no motion leads to from the other samples."""
    rows, sample = samples_of(positions)
    if len(rows) < AROUND:
        return np.zeros(positions.shape[1], dtype=np.bool_)
    times, places = period * rows, positions[:, rows]
    apart = np.diff(times)
    steps = np.diff(places, axis=1)
    usual = median_filter(steps / apart, (1, AROUND), mode="nearest") * apart
    room = FAR + NOISE * noise + QUICK * apart * np.maximum(apart, 3 * np.median(apart))
    breaks = np.flatnonzero(np.hypot(*(steps - usual)) > room) + 1
    edges = np.concatenate([[0], breaks, [len(rows)]])
    good = np.zeros(len(rows), dtype=np.bool_)
    longest = int(np.argmax(np.diff(edges)))
    good[edges[longest] : edges[longest + 1]] = True
    for order in (range(longest + 1, len(edges) - 1), range(longest - 1, -1, -1)):
        last = int(edges[longest + 1]) - 1 if order.step > 0 else int(edges[longest])
        for part in order:
            inside = np.arange(edges[part], edges[part + 1])[:: order.step]
            tried = inside[:TRIED]
            slack = FAR + NOISE * noise + DRIFT * np.abs(times[tried] - times[last])
            near = np.flatnonzero(np.hypot(*(places[:, tried] - places[:, [last]])) <= slack)
            if len(near):
                good[inside[near[0] :]] = True
                last = int(inside[-1])
    return np.asarray(~good[sample] & numbers(positions))


def held(positions: Array, pressures: Array, period: float, moved: float) -> Mask:
    """Rows (T,) in which a tracker repeats a sample for longer than ``STILL`` although the head moves on meanwhile, or
    although a chamber's pressure changes by ``moved``."""
    rows, sample = samples_of(positions)
    known = numbers(positions)
    ends = np.append(rows[1:], positions.shape[1])
    shown = np.bincount(sample[known], minlength=len(rows))
    found = np.zeros(positions.shape[1], dtype=np.bool_)
    for k in np.flatnonzero(period * shown > max(STILL, 6 * period * float(np.median(shown)))):
        first, end = int(rows[k]), int(ends[k])
        on = end < len(known) and np.hypot(*(positions[:, end] - positions[:, first])) > PASSED
        found[first:end] = on or np.ptp(pressures[:, first:end], axis=1).max() > moved
    return np.asarray(found & known)


def pinned(positions: Array) -> Mask:
    """Rows (T,) in which an axis of a tracker shows the end of its range, though the head moves on."""
    rows, sample = samples_of(positions)
    found = np.any([clipped(axis, PASSED) for axis in positions[:, rows]], axis=0)
    return np.asarray(found[sample] & numbers(positions))
