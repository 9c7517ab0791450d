"""Figures of the stability maps: filled cells for what remains of a push, and the border of what is stable."""

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from baselines.figures.style import ACCENT, DARK, LOST, PAGE, STYLE, headline, label_of, legend_below, log_ticks, save
from birthsim_env.physics.compiled.lanes import Array

RANGE = (0.01, 100.0)
"""mm, of the colours."""


def stability_figure(name: str, chart: dict[str, Any], heading: str, folder: Path) -> list[Path]:
    """One map of ``lab.studies.stability.maps.draw_map``, a panel per variant; ``heading`` names controller and sensors."""
    count = len(chart["variants"])
    with plt.rc_context({**STYLE, "axes.grid": False}):
        figure, panels = plt.subplots(1, count, figsize=(PAGE, 2.9), layout="constrained", sharey=True, squeeze=False)
        across, up = (_edges(_places(chart[side]), chart[side]["logarithmic"]) for side in "xy")
        lost = False
        for axes, (label, found) in zip(panels[0], chart["variants"].items(), strict=True):
            motion, stable = np.array(found["motion_mm"], dtype=float), np.array(found["stable"])
            axes.set_facecolor(LOST)
            lost |= bool(np.isnan(motion).any())
            drawn = axes.pcolormesh(
                across, up, np.clip(motion, *RANGE), norm=LogNorm(*RANGE), cmap="YlOrBr", edgecolors="white", lw=0.3
            )
            _border(axes, across, up, stable)
            _believed(axes, chart["believed"])
            for side, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
                if chart[side]["logarithmic"]:
                    getattr(axes, f"set_{side}scale")("log")
                    log_ticks(axis, 1.0)
                    if chart[side]["values"][0] == 0.0:
                        axis.set_ticks(_places(chart[side])[::3], [f"{value:g}" for value in chart[side]["values"][::3]])
                        axis.set_ticks([], minor=True)
            axes.set(xlabel=chart["x"]["label"], xlim=across[[0, -1]], ylim=up[[0, -1]])
            axes.set_title(f"{label_of(label)}\n{100 * stable.mean():.0f} % of the cells stable")
        panels[0, 0].set_ylabel(fill(chart["y"]["label"], 30))
        bar = figure.colorbar(drawn, ax=panels, pad=0.015, extend="both")
        bar.set_label("motion that remains (mm)")
        bar.ax.yaxis.set_major_formatter("{x:g}")
        handles: list[Any] = [Line2D([], [], color=DARK, lw=2, label="border of what is stable")]
        if any(place is not None for place in chart["believed"]):
            look = {"ls": "--"} if None in chart["believed"] else {"ls": "", "marker": "*", "ms": 11}
            handles.append(Line2D([], [], color=ACCENT, label="what the controller believes", **look))
        if lost:
            handles.append(Patch(color=LOST, label="lost: ran into a stop"))
        share = {label: 100 * float(np.mean(found["stable"])) for label, found in chart["variants"].items()}
        best = max(share, key=share.__getitem__)
        headline(figure, f"{chart['title']}, {heading}: at most {share[best]:.0f} % of the cells are stable ({label_of(best)})")
        legend_below(figure, said="motion peak to peak after a push", also=handles)
        return save(figure, folder, f"stability_{name}")


def _places(side: dict[str, Any]) -> Array:
    """Where the values of a side (n,) are drawn: on a logarithmic one a first value of 0 as far from the second as that from
    the third."""
    values = np.array(side["values"], dtype=np.float64)
    if side["logarithmic"] and values[0] == 0.0:
        values[0] = values[1] ** 2 / values[2]
    return values


def _edges(values: Array, logarithmic: bool) -> Array:
    """Between and beyond the values (n,): (n + 1,)."""
    scale = np.log(values) if logarithmic else values
    half = np.diff(scale) / 2 if len(values) > 1 else np.full(1, 0.5)
    edges = np.concatenate([[scale[0] - half[0]], scale[: len(half)] + half, [scale[-1] + half[-1]]])[: len(values) + 1]
    return np.exp(edges) if logarithmic else edges


def _border(axes: Axes, x: Array, y: Array, stable: Array) -> None:
    """Lines along the edges of cells where stable ones (rows over y) meet others."""
    style: dict[str, Any] = {"colors": DARK, "lw": 2, "zorder": 3}
    rows, columns = np.nonzero(stable[:, 1:] != stable[:, :-1])
    axes.vlines(x[columns + 1], y[rows], y[rows + 1], **style)
    rows, columns = np.nonzero(stable[1:] != stable[:-1])
    axes.hlines(y[rows + 1], x[columns], x[columns + 1], **style)


def _believed(axes: Axes, place: list[float | None]) -> None:
    """A star where both coordinates are believed, a line where one is."""
    x, y = place
    if x is not None and y is not None:
        axes.plot(x, y, color=ACCENT, marker="*", ms=13, mec="white", zorder=4)
    elif y is not None:
        axes.axhline(y, color=ACCENT, lw=1.2, ls="--", zorder=4)
    elif x is not None:
        axes.axvline(x, color=ACCENT, lw=1.2, ls="--", zorder=4)
