"""Figures of the bench: error in every environment, and what it costs in air."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from baselines.figures.style import DARK, MIDDLE, PAGE, STYLE, headline, label_of, legend_below, log_ticks, save
from lab.studies.comparison.grid import known
from lab.studies.comparison.tables import CIRCLE, Figures, controllers_of

CONDITIONS = {
    ("ideal", "nominal"): {"marker": "o", "color": DARK, "mfc": DARK},
    ("ideal", "randomised"): {"marker": "o", "color": DARK, "mfc": "white"},
    ("lab", "nominal"): {"marker": "^", "color": MIDDLE, "mfc": MIDDLE},
    ("lab", "randomised"): {"marker": "^", "color": MIDDLE, "mfc": "white"},
    ("honest", "nominal"): {"marker": "s", "color": MIDDLE, "mfc": MIDDLE},
    ("honest", "randomised"): {"marker": "s", "color": MIDDLE, "mfc": "white"},
    ("honest", "drawn-sensors"): {"marker": "D", "color": DARK, "mfc": "white"},
    ("honest", "described-sensors"): {"marker": "D", "color": MIDDLE, "mfc": MIDDLE},
}
"""Sensors and plant -> how they look."""


def draw_comparison(figures: Figures, folder: Path) -> list[Path]:
    """Both figures; returns the files written."""
    figures = [cell for cell in figures if not cell.get("hand")]
    if not figures:
        return []
    with plt.rc_context(STYLE):
        return [*settled_figure(figures, folder), *air_figure(figures, folder)]


def settled_figure(figures: Figures, folder: Path) -> list[Path]:
    """Settled RMS error, median with its interval: a panel per environment, a row per controller."""
    names = controllers_of(figures)
    environments = list(dict.fromkeys(cell["environment"] for cell in figures))
    present = [key for key in CONDITIONS if any((cell["sensors"], cell["plant"]) == key for cell in figures)]
    size = PAGE, 1.2 + 0.3 * len(names) + 0.12 * len(present)
    figure, panels = plt.subplots(1, len(environments), figsize=size, layout="constrained", sharey=True, squeeze=False)
    first = [key for key in present if key[1] != "nominal"] or present
    least = dict[str, tuple[float, str]]()
    for axes, environment in zip(panels[0], environments, strict=True):
        here = [cell for cell in figures if cell["environment"] == environment]
        low, high = _limits(here, "settled_rms")
        for cell in here:
            key = cell["sensors"], cell["plant"]
            style, found = CONDITIONS[key], cell["metrics"]["settled_rms"]
            row = names.index(cell["controller"]) + 0.7 * ((present.index(key) + 0.5) / len(present) - 0.5)
            if np.isfinite(found["median"]):
                axes.hlines(row, found["low"], min(found["high"], high), color=style["color"], lw=0.9)
                axes.plot(found["median"], row, ls="", ms=3.5, **style, label=known(*key))
                if key == first[0]:
                    least[environment] = min(least.get(environment, (np.inf, "")), (found["median"], cell["controller"]))
            elif np.isinf(found["median"]):
                _say_lost(axes, high / 1.05, row, style["color"])
        axes.set(xscale="log", xlim=(low, high), title=re.sub(r"^BirthSIM/|-v\d+$", "", environment))
        axes.set_xlabel("error (mm)")
        log_ticks(axes.xaxis, 1.0)
        axes.grid(axis="y", visible=False)
        for row in range(1, len(names)):
            axes.axhline(row - 0.5, color="black", alpha=0.15, lw=0.6)
    panels[0, 0].set_yticks(range(len(names)), [label_of(name) for name in names])
    panels[0, 0].set_ylim(len(names) - 0.5, -0.5)
    wins = Counter(name for _, name in least.values()).most_common(1)
    if wins:
        name, times = wins[0]
        headline(
            figure,
            f"{label_of(name)} has the least settled error in {times} of {len(environments)} environments: {known(*first[0])}",
        )
    legend_below(figure, said="RMS settled error: medians with 95 % intervals")
    return save(figure, folder, "settled_error")


def _say_lost(axes: Axes, place: float, row: float, color: str) -> None:
    """In place of a median that is infinite."""
    axes.text(place, row, "lost", ha="right", va="center", fontsize=plt.rcParams["xtick.labelsize"], color=color)


def _limits(figures: Figures, metric: str) -> tuple[float, float]:
    """Ends of a logarithmic axis that holds every finite figure."""
    said = [v for cell in figures for k in ("low", "median", "high") if np.isfinite(v := cell["metrics"][metric][k])]
    return (min(said) / 1.5, max(said) * 1.5) if said else (0.1, 10.0)


def air_figure(figures: Figures, folder: Path) -> list[Path]:
    """Settled error beside the air used, a row per controller, on the nominal plant: medians with their intervals."""
    environments = [cell["environment"] for cell in figures]
    environment = CIRCLE if CIRCLE in environments else environments[0]
    plants = [cell["plant"] for cell in figures]
    plant = "nominal" if "nominal" in plants else plants[0]
    here = [cell for cell in figures if (cell["environment"], cell["plant"]) == (environment, plant)]
    lowest = min(here, key=lambda cell: cell["metrics"]["settled_rms"]["median"])
    names = sorted(controllers_of(here), key=lambda name: _error_of(here, name))
    sensors = list(dict.fromkeys(cell["sensors"] for cell in here))
    size = PAGE, 1.2 + 0.17 * len(names)
    figure, (left, right) = plt.subplots(1, 2, figsize=size, layout="constrained", sharey=True)
    left.set(xscale="log", xlim=_limits(here, "settled_rms"))
    right.set_xlim(0, _limits(here, "air")[1])
    for axes, metric in ((left, "settled_rms"), (right, "air")):
        top = axes.get_xlim()[1]
        for cell in here:
            style, found = CONDITIONS[cell["sensors"], plant], cell["metrics"][metric]
            row = names.index(cell["controller"]) + 0.5 * ((sensors.index(cell["sensors"]) + 0.5) / len(sensors) - 0.5)
            if np.isfinite(found["median"]):
                axes.hlines(row, found["low"], min(found["high"], top), color=style["color"], lw=0.9)
                axes.plot(found["median"], row, ls="", ms=3.5, **style, label=f"{cell['sensors']} sensors")
            elif np.isinf(found["median"]):
                _say_lost(axes, top / 1.05, row, style["color"])
        axes.grid(axis="y", visible=False)
        for row in range(1, len(names)):
            axes.axhline(row - 0.5, color="black", alpha=0.15, lw=0.6)
    log_ticks(left.xaxis, 1.0)
    left.set_xlabel("settled error (mm)")
    right.set_xlabel("air used (normal l/min)")
    left.set_yticks(range(len(names)), [label_of(name) for name in names])
    left.set_ylim(len(names) - 0.5, -0.5)
    short = re.sub(r"^BirthSIM/|-v\d+$", "", environment)
    error, air = (lowest["metrics"][kind]["median"] for kind in ("settled_rms", "air"))
    headline(figure, f"Least error: {label_of(lowest['controller'])}, {error:.2g} mm with {air:.2g} l/min")
    legend_below(figure, said=f"{short}, {plant.replace('drawn-sensors', 'nominal')} rig: medians with 95 % intervals")
    return save(figure, folder, "air_against_error")


def _error_of(figures: Figures, name: str) -> float:
    """The mean of a controller's medians over sensors, on a logarithmic scale, by which rows are sorted."""
    return float(np.mean([np.log(cell["metrics"]["settled_rms"]["median"]) for cell in figures if cell["controller"] == name]))
