"""Heat maps of a sweep: cells for values on a grid, points for drawn ones."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.colors import LogNorm, Normalize
from matplotlib.patches import Patch

from baselines.bench.metrics import UNITS
from baselines.bench.statistics import number
from baselines.figures.style import COLUMN, LOST, PAGE, STYLE, headline, label_of, legend_below, log_ticks, save
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import DECLARED
from lab.studies.sweeps.plan import HeatMap
from lab.studies.sweeps.report import as_float, short

WRITTEN = 150
"""Cells of a panel that still have room for their figures."""


def draw_map(name: str, chart: HeatMap, found: Sequence[dict[str, Any]], folder: Path) -> list[Path]:
    """One picture of what ``lab.studies.sweeps.report.figures`` found; a cell is the mean over what else varies."""
    panels = list(dict.fromkeys(row["point"].get(chart.per) for row in found)) if chart.per else [None]
    shown = [[row for row in found if not chart.per or row["point"].get(chart.per) == panel] for panel in panels]
    values = [np.array([as_float(row["metrics"][chart.metric][chart.statistic]) for row in rows]) for rows in shown]
    finite = np.concatenate([size[np.isfinite(size)] for size in values])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    norm = LogNorm(low, high) if low > 0 and high > 5 * low else Normalize(low, high)
    with plt.rc_context({**STYLE, "axes.grid": False}):
        figure, axes = plt.subplots(
            1, len(panels), figsize=(COLUMN if len(panels) < 2 else PAGE, 2.9), layout="constrained", sharey=True, squeeze=False
        )
        for place, panel, rows, size in zip(axes[0], panels, shown, values, strict=True):
            x, y = (_places([row["point"].get(side) for row in rows]) for side in (chart.x, chart.y))
            drawn = _panel(place, x, y, size, norm)
            place.set(xlabel=_label(chart.x), title="" if panel is None else f"{chart.per} = {label_of(short(panel))}")
        axes[0, 0].set_ylabel(_label(chart.y))
        bar = figure.colorbar(drawn, ax=axes, pad=0.015)
        metric, unit = chart.metric.replace("rms", "RMS error").replace("_", " "), UNITS[chart.metric]
        bar.set_label(f"{metric}, {chart.statistic} ({unit})")
        if isinstance(norm, LogNorm):
            log_ticks(bar.ax.yaxis)
        headline(figure, f"{metric[0].upper()}{metric[1:]}: {low:.2g} to {high:.2g} {unit}")
        if any(np.isinf(size).any() for size in values):
            legend_below(figure, also=[Patch(color=LOST, label="infinite: so many episodes were lost")])
        return save(figure, folder, name)


def _panel(axes: Any, x: tuple[Array, list[str]], y: tuple[Array, list[str]], size: Array, norm: Normalize) -> Any:
    look: dict[str, Any] = {"norm": norm, "cmap": "YlOrBr"}
    (across, columns), (up, rows) = x, y
    if len(columns) * len(rows) > len(size):
        lost = np.isinf(size)
        axes.scatter(across[lost], up[lost], color=LOST, marker="x")
        return axes.scatter(across[~lost], up[~lost], c=size[~lost], ec="0.4", lw=0.4, **look)
    cells = np.full((len(rows), len(columns)), np.nan)
    at = np.unique(across, return_inverse=True)[1], np.unique(up, return_inverse=True)[1]
    for i in range(len(rows)):
        for j in range(len(columns)):
            cells[i, j] = size[(at[0] == j) & (at[1] == i)].mean()
    axes.set_facecolor(LOST)
    drawn = axes.pcolormesh(
        np.arange(len(columns) + 1), np.arange(len(rows) + 1), np.where(np.isinf(cells), np.nan, cells), ec="white", **look
    )
    if cells.size <= WRITTEN:
        for (i, j), value in np.ndenumerate(cells):
            dark = not np.isfinite(value) or norm(value) > 0.6
            axes.text(
                j + 0.5,
                i + 0.5,
                number(value),
                ha="center",
                va="center",
                fontsize=plt.rcParams["xtick.labelsize"],
                color="white" if dark else "black",
            )
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns)
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows)
    return drawn


def _places(values: Sequence[Any]) -> tuple[Array, list[str]]:
    """Values as coordinates, and the labels of those that differ, in order; words in the order in which they come."""
    if all(isinstance(value, (int, float)) for value in values):
        places = np.array(values, dtype=float)
        return places, [f"{value:.4g}" for value in np.unique(places)]
    order = {word: float(k) for k, word in enumerate(dict.fromkeys(map(str, values)))}
    return np.array([order[str(value)] for value in values]), list(order)


def _label(name: str) -> str:
    """A name with its unit, where it is a parameter of the rig."""
    group, _, rest = name.partition(".")
    return f"{rest.replace('_', ' ').replace('.', ': ')} ({DECLARED[rest].unit})" if group in ("rig", "believed") else name
