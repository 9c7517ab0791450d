"""The one style of figures: findings as titles, legends outside, text and colours for a printed column and a grey print.

``drawn_for("paper")`` draws the same figures for a paper: without titles, which a caption takes over, and as PDF.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
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
UNDATED: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
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


POINTS = 8.0
"""Of all letters in a paper."""

PAPER: Any = {
    **STYLE,
    **dict.fromkeys(("font.size", "axes.titlesize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize"), POINTS),
    "pdf.fonttype": 42,
}
"""As ``STYLE``, with fonts that a PDF carries with it as TrueType."""

PRINTED = {COLUMN: 3.5, PAGE: 7.16}
"""Inches of a paper's column and of two, for figures that are a column or a page wide."""

FORMATS = {"screen": ("png", "svg"), "paper": ("pdf",)}
"""What figures are drawn for -> the files of each."""

_CHOSEN: ContextVar[str] = ContextVar("kind", default="screen")
_SCREEN = dict(STYLE)


@contextmanager
def drawn_for(kind: str) -> Iterator[None]:
    """Within it figures are drawn for one of ``FORMATS``: "screen" writes PNG and SVG, "paper" a PDF of a column's width."""
    token = _CHOSEN.set(kind)
    STYLE.update(PAPER if kind == "paper" else _SCREEN)
    try:
        yield
    finally:
        _CHOSEN.reset(token)
        STYLE.clear()
        STYLE.update(PAPER if _CHOSEN.get() == "paper" else _SCREEN)


def linked(paths: Sequence[Path]) -> list[str]:
    """Markdown of the figures that ``save`` wrote to ``paths``: each as a picture once, or as a link to its PDF."""
    links = [f"[{path.name}]({path.name})" for path in paths if path.suffix != ".svg"]
    return [link if ".pdf" in link else f"!{link}" for link in links]


def look(k: int, markers: bool = True) -> dict[str, Any]:
    """Colour, line style and marker of the k-th of several controllers: twelve that a grey print tells apart by marker, and
    twelve more whose markers are hollow."""
    return {
        "color": COLOURS[k % len(COLOURS)], "linestyle": LINES[(k + k // len(COLOURS)) % len(LINES)],
        **({"marker": MARKERS[k % len(MARKERS)]} if markers else {}),
        **({"mfc": "white"} if markers and k >= len(MARKERS) else {}),
    }  # fmt: skip


def log_ticks(axis: Axis, *subs: float) -> None:
    """Labels 1, 2 and 5 (or ``subs``) of every decade as plain numbers, on a logarithmic axis that has its limits.

    Where ``subs`` is 1 alone and less than two decades are in sight, 3 stands beside it, so that no axis has a single label."""
    low, high = axis.get_view_interval()
    if subs == (1.0,) and high < 100.0 * low:
        subs = (1.0, 3.0)
    axis.set_major_locator(LogLocator(subs=subs or (1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def label_of(controller: str) -> str:
    """A controller's name for a picture: a file without its folders, at most 36 letters."""
    name = controller.rpartition("/")[2]
    return name if len(name) <= 36 else f"{name[:35]}…"


def headline(figure: Figure, finding: str) -> None:
    """Write what the figure shows above it, in lines that fit its width; no line ends between a number and its unit.

    In a paper the caption says it."""
    if _CHOSEN.get() == "paper":
        return
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
        points = STYLE["legend.fontsize"]
        column = 0.36 + 0.0535 * points / 7.0 * max(map(len, shown))
        columns = max(1, min(4, int(figure.get_figwidth() / column)))
        heading = fill(said, int(119.0 / points * figure.get_figwidth())) or None
        figure.legend(
            list(shown.values()),
            list(shown),
            loc="outside lower center",
            ncol=columns,
            title=heading,
            title_fontsize=points,
            handlelength=2,
            columnspacing=1.2,
            borderpad=0.1,
        )


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write the files of a figure, the same bytes for the same figure, and close it; returns their paths."""
    paths = [folder / f"{name}.{kind}" for kind in FORMATS[_CHOSEN.get()]]
    if _CHOSEN.get() == "paper":
        width = min(PRINTED, key=lambda one: abs(one - figure.get_figwidth()))
        figure.set_figwidth(PRINTED[width])
        if len(figure.axes) == 1:
            figure.axes[0].set_title("", loc="left")
    with plt.rc_context({"svg.hashsalt": name}):
        for path in paths:
            with whole_file(path) as file:
                kind = path.suffix[1:]
                figure.savefig(file, format=kind, dpi=150, metadata=UNDATED.get(kind))
    plt.close(figure)
    return paths
