"""What the figures of studies share beyond those of the packages: looks of many controllers, their names, logarithmic ticks."""

from typing import Any

from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, NullFormatter

from baselines.figures.runs import ACCENT, DARK, LIGHT, LINES, MIDDLE

COLOURS = (DARK, MIDDLE, ACCENT, LIGHT, "#b8860b", "#8e5ea2")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">", "h", "p")


def look(k: int) -> dict[str, Any]:
    """Colour, line style and marker of the k-th of several controllers: twelve that a grey print tells apart by marker."""
    return {
        "color": COLOURS[k % len(COLOURS)], "linestyle": LINES[(k + k // len(COLOURS)) % len(LINES)],
        "marker": MARKERS[k % len(MARKERS)],
    }  # fmt: skip


def log_ticks(axis: Axis) -> None:
    """Labels 1, 2 and 5 of every decade as plain numbers, on an axis that is already logarithmic."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def label_of(controller: str) -> str:
    """A controller's name for a picture: a file without its folders, at most 36 letters."""
    name = controller.rpartition("/")[2]
    return name if len(name) <= 36 else f"{name[:35]}…"
