"""Figures of a log beside rigs: the log against free-running models, their errors, and windows with the worst marked."""

from math import isfinite
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from baselines.figures.style import COLUMN, DARK, PAGE, STYLE, headline, label_of, legend_below, look, save
from baselines.identification.comparing.compared import Compared, Comparison
from baselines.identification.comparing.report import curve_of
from baselines.identification.comparing.signals import Signal
from birthsim_env.physics.compiled.lanes import Array

POINTS = 2000
"""Of a curve, at most: more than a printed page is dots wide."""

UNITS = {"Pa": (1e-3, "kPa"), "m": (1e3, "mm")}
"""Unit of a signal -> factor and unit in a figure."""


def free_run_figure(found: Comparison, folder: Path) -> list[Path]:
    """A row per signal: the log against every rig's model in free run, and the error with the limit."""
    count = len(found.signals)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            count, 2, figsize=(PAGE, 1.15 * count + 1.0), layout="constrained", sharex=True, squeeze=False
        )
        for (left, right), signal in zip(axes, found.signals, strict=True):
            _beside(left, right, found, signal)
        for panel in axes[-1]:
            panel.set_xlabel("time (s)")
        axes[0, 0].set_title("log and model in free run")
        axes[0, 1].set_title("log less model, with the limit")
        times = [min(leaving.after for leaving in one.free.leaves) for one in found.rigs]
        left = ", ".join(
            f"{label_of(one.name)} {f'leaves the log after {time:.2g} s' if isfinite(time) else 'stays with the log'}"
            for one, time in zip(found.rigs, times, strict=True)
        )
        headline(figure, f"In free run {left}")
        legend_below(figure)
        return save(figure, folder, "free_run")


def _beside(left: Axes, right: Axes, found: Comparison, signal: Signal) -> None:
    factor, unit = UNITS[signal.unit]
    k = found.signals.index(signal)
    when, log, _ = curve_of(found.rigs[0].free.tracks[k], POINTS)
    left.plot(when, factor * log, color=DARK, lw=1.6, label="log")
    for number, one in enumerate(found.rigs):
        times, _, error = curve_of(one.free.tracks[k], POINTS)
        style = {**look(number + 1, markers=False), "label": label_of(one.name)}
        # What sensors add was taken off with each rig; the log is drawn once.
        left.plot(times, factor * (np.interp(times, when, log) - error), **style)
        right.plot(times, factor * error, **style)
    limit = factor * found.limits[signal.name]
    for sign in (-1.0, 1.0):
        right.axhline(sign * limit, color="black", lw=0.6, ls=(0, (1, 3)), label="limit")
    left.set_ylabel(f"{signal.name}\n({unit})")
    right.set_ylabel(f"({unit})")


def windows_figure(found: Comparison, folder: Path) -> list[Path]:
    """The error over the noise of each window, pressures and positions, with each rig's worst windows marked."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 1, figsize=(COLUMN, 3.8), layout="constrained", sharex=True)
        for panel, unit, title in zip(axes, ("Pa", "m"), ("pressures", "positions"), strict=True):
            for number, one in enumerate(found.rigs):
                middles, sizes = one.starts + 0.5 * found.window, _sizes(one, unit)
                style = look(number + 1, markers=False)
                panel.plot(middles, sizes, **style, label=label_of(one.name))
                worst = np.searchsorted(one.starts, [window.start for window in one.worst])
                mark = look(number + 1) | {"linestyle": "none", "mfc": "white"}
                panel.plot(middles[worst], sizes[worst], **mark, label=f"{label_of(one.name)}, worst windows")
            panel.axhline(1.0, color="black", lw=0.6, ls=(0, (1, 3)), label="sensors' noise")
            panel.set(ylabel="RMS over noise (-)", title=title, yscale="log")
            panel.yaxis.set_major_formatter("{x:g}")
            panel.yaxis.set_minor_formatter("")
        axes[1].set_xlabel("time (s)")
        said = ", ".join(f"{place.error:.2f} ({label_of(place.name)})" for place in found.places)
        headline(figure, f"In windows that begin anew the error is {said} times the noise")
        legend_below(figure)
        return save(figure, folder, "windows")


def _sizes(one: Compared, unit: str) -> Array:
    """RMS over the noise of each window (W,), of the signals with a unit."""
    sizes = [track.off / track.signal.noise for track in one.tracks if track.signal.unit == unit]
    return np.asarray(np.sqrt(np.nanmean(np.square(sizes), axis=0)))
