"""The one style of figures: findings as titles, legends outside, text and colours for a printed column and a grey print."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from birthsim_env.files import whole_file

COLUMN, PAGE = 85 / 25.4, 178 / 25.4
"""Inches: a printed column, and two with the space between them. Every figure is as wide as one of them."""

DARK, MIDDLE, ACCENT, LIGHT = "#1b2a41", "#9c3208", "#2f9059", "#6b96c8"
"""Colours from dark to light: in grey an eighth of the way from black to white apart. Line styles and markers differ too."""

COLOURS = (DARK, MIDDLE, ACCENT, LIGHT, "#a97b06", "#8e5ea2")
LINES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">", "h", "p")
LOST = "#303030"
"""Of cells and marks where the end effector was lost."""

STYLE: Any = {
    "font.size": 7.5,
    "figure.titlesize": 8.5,
    "figure.titleweight": "bold",
    "axes.titlesize": 7.5,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.frameon": False,
    "legend.fontsize": 7,
}


def look(k: int, markers: bool = True) -> dict[str, Any]:
    """Colour, line style and marker of the k-th of several controllers: twelve that a grey print tells apart by marker, and
    twelve more whose markers are hollow."""
    return {
        "color": COLOURS[k % len(COLOURS)], "linestyle": LINES[(k + k // len(COLOURS)) % len(LINES)],
        **({"marker": MARKERS[k % len(MARKERS)]} if markers else {}),
        **({"mfc": "white"} if markers and k >= len(MARKERS) else {}),
    }  # fmt: skip


def log_ticks(axis: Axis, *subs: float) -> None:
    """Labels 1, 2 and 5 (or ``subs``) of every decade as plain numbers, on an axis that is already logarithmic."""
    axis.set_major_locator(LogLocator(subs=subs or (1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def label_of(controller: str) -> str:
    """A controller's name for a picture: a file without its folders, at most 36 letters."""
    name = controller.rpartition("/")[2]
    return name if len(name) <= 36 else f"{name[:35]}…"


def headline(figure: Figure, finding: str) -> None:
    """Write what the figure shows above it, in lines that fit its width; no line ends between a number and its unit."""
    width = figure.get_figwidth()
    figure.suptitle(fill(re.sub(r"(?<=\d) (?=\S)", "\N{NO-BREAK SPACE}", finding), int(13 * width)), x=0.05 / width, ha="left")


def legend_below(figure: Figure, axes: Iterable[Axes] | None = None, said: str = "", also: Sequence[Any] = ()) -> None:
    """One legend under all panels with every label of ``axes`` and of the handles ``also``; ``said`` of all stands above."""
    shown: dict[str, Any] = {}
    for panel in figure.axes if axes is None else axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            shown.setdefault(label, handle)
    shown |= {str(handle.get_label()): handle for handle in also}
    if shown:
        # Inches: of the handle with its spaces, and of a letter.
        column = 0.36 + 0.0535 * max(map(len, shown))
        columns = max(1, min(4, int(figure.get_figwidth() / column)))
        heading = fill(said, int(17 * figure.get_figwidth())) or None
        figure.legend(
            list(shown.values()),
            list(shown),
            loc="outside lower center",
            ncol=columns,
            title=heading,
            title_fontsize=7,
            handlelength=2,
            columnspacing=1.2,
            borderpad=0.1,
        )


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write ``name``.png and ``name``.svg, the same bytes for the same figure, and close it; returns both paths."""
    paths = [folder / f"{name}.{kind}" for kind in ("png", "svg")]
    with plt.rc_context({"svg.hashsalt": name}):
        for path in paths:
            with whole_file(path) as file:
                kind = path.suffix[1:]
                figure.savefig(file, format=kind, dpi=150, metadata={"Date": None} if kind == "svg" else None)
    plt.close(figure)
    return paths
