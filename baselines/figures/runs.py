"""Figures: PNG and SVG, units on every axis, line styles that survive a grey print."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.bench.evaluation import Evaluation
from baselines.bench.measures import TRACE
from birthsim_env.files import whole_file
from birthsim_env.physics.compiled.lanes import Array

DARK, MIDDLE, ACCENT, LIGHT = "#1b2a41", "#b23a0a", "#3f9e6a", "#8fb2dc"
"""Colours from dark to light: in grey they lie a sixth of the way from black to white apart. Line styles differ too."""

LINES = ("-", "--", "-.", ":")
STYLE: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.fontsize": 8,
}


def legend_below(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    """A legend under all panels, in as many columns as fit its longest label."""
    if labels:
        # Inches: of the handle with its spaces, and of a letter of the legend's size.
        column = 0.65 + 0.068 * max(len(label) for label in labels)
        columns = max(1, min(4, int(figure.get_figwidth() / column)))
        figure.legend(handles, labels, loc="outside lower center", ncol=columns)


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


def figure4(record: dict[str, Array], folder: Path) -> list[Path]:
    """The paper's Fig. 4 from a run: ``record`` holds ``info`` fields over time, (T,) or (T, 2), SI units."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(11, 7.5), layout="constrained")
        _setpoints(axes[0, 0], record)
        _pneumatic(axes[0, 1], record)
        _path(axes[1, 0], record)
        _coordinates(axes[1, 1], record)
        return save(figure, folder, "figure4")


def _letter(axes: Axes, letter: str, title: str) -> None:
    axes.set_title(f"({letter}) {title}", loc="left", fontsize=9.5)


def _setpoints(axes: Axes, record: dict[str, Array]) -> None:
    time = record["time"]
    axes.plot(time, record["user_force"][:, 0], color=DARK, label="$F_{us,x}$")
    axes.plot(time, record["user_force"][:, 1], color=MIDDLE, ls="--", label="$F_{us,y}$")
    axes.set(xlabel="time (s)", ylabel="user force (N)")
    axes.set_ylim(-60, 45)
    right = axes.twinx()
    right.plot(time, record["stiffness_setpoint"][:, 0], color=LIGHT, lw=2.5, label="$K_{clx} = K_{cly}$ (right)")
    right.set(ylabel="closed-loop stiffness setpoint (N/m)", ylim=(0, 9000))
    right.set_yticks(range(0, 9000, 2000))
    right.grid(False)
    right.spines["right"].set_visible(True)
    lines = [*axes.get_lines(), *right.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], ncol=3, loc="lower center")
    _letter(axes, "a", "User force and stiffness setpoint")


def _pneumatic(axes: Axes, record: dict[str, Array]) -> None:
    for k, colour in ((0, DARK), (1, MIDDLE)):
        axes.plot(record["time"], record["pneumatic_stiffness"][:, k], color=colour, label=f"$K_{{pneu{k + 1}}}$")
    setpoints = axes.plot(record["time"], record["pneumatic_stiffness_setpoint"], color="black", ls=":", lw=1.5)
    setpoints[0].set_label("setpoints")
    axes.set(xlabel="time (s)", ylabel="pneumatic stiffness (N/m)", ylim=(0, 6000))
    axes.legend(ncol=3, loc="upper center")
    _letter(axes, "b", "Pneumatic stiffness")


def _path(axes: Axes, record: dict[str, Array]) -> None:
    half = record["stiffness_setpoint"][:, 0] <= np.median(np.unique(record["stiffness_setpoint"][:, 0]))
    target = 1e3 * record["target"]
    axes.plot(target[:, 0], target[:, 1], color="black", lw=0.8, label="target")
    for chosen, colour, style, name in ((half, LIGHT, "-", "softer half"), (~half, MIDDLE, "--", "stiffer half")):
        position = 1e3 * record["position"][chosen]
        axes.plot(position[:, 0], position[:, 1], color=colour, ls=style, label=f"end effector, {name}")
    axes.set(xlabel="$x_c$ (mm)", ylabel="$y_c$ (mm)")
    axes.set_aspect("equal", anchor="W")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    _letter(axes, "c", "Cartesian path")


def _coordinates(axes: Axes, record: dict[str, Array]) -> None:
    centre = 1e3 * record["target"].mean(axis=0)
    for field, colour, style, width, label in (
        ("target", "black", ":", 1.2, "target $x_t$, $y_t$"),
        ("compliant_target", LIGHT, "-", 3.0, "compliant target $x_k$, $y_k$ (19)"),
        ("position", MIDDLE, "-", 1.0, "end effector $x_c$, $y_c$"),
    ):
        moved = 1e3 * record[field] - centre + (75.0, -75.0)
        axes.plot(record["time"], moved, color=colour, ls=style, lw=width)[0].set_label(label)
    axes.set(xlabel="time (s)", ylabel="coordinate less its mean (mm)", ylim=(-145, 175))
    axes.set_yticks([-125, -75, -25, 25, 75, 125], ["−50", "$y$ 0", "50", "−50", "$x$ 0", "50"])
    axes.legend(ncol=3, loc="upper center", columnspacing=1.0, handlelength=1.5)
    _letter(axes, "d", "Coordinates")


def episode_figure(episode: dict[str, Array], title: str, folder: Path) -> list[Path]:
    """``episode.png`` and ``.svg`` from rows of time (s), positions and errors (m) and the hand's force (N), each (T, 2)."""
    time, millimetres = episode["time"], 1e3
    with plt.rc_context(STYLE):
        figure, (path, error, force) = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
        for name, colour, style in (("compliant_target", MIDDLE, "--"), ("position", DARK, "-")):
            path.plot(*(millimetres * episode[name].T), color=colour, ls=style, lw=1.2, label=name.replace("_", " "))
        path.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
        figure.suptitle(title, fontsize=9)
        path.legend()
        error.plot(time, millimetres * np.linalg.norm(episode["tracking_error"], axis=1), color=DARK, lw=1)
        error.set(xlabel="time (s)", ylabel="tracking error (mm)")
        for k, (axis, style) in enumerate((("x", "-"), ("y", "--"))):
            force.plot(time, episode["user_force"][:, k], color=(DARK, MIDDLE)[k], ls=style, lw=1, label=axis)
        force.set(xlabel="time (s)", ylabel="force of the hand (N)")
        force.legend()
        return save(figure, folder, "episode")


def error_over_time(evaluations: Sequence[Evaluation], title: str, folder: Path) -> list[Path]:
    """Size of the tracking error over time: median and 5-95 % band over the episodes, one line per controller."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(9, 4), layout="constrained")
        lowest = np.inf
        colours, styles = (DARK, MIDDLE, ACCENT, LIGHT), LINES
        for k, evaluation in enumerate(evaluations):
            # The fifth controller has the first one's colour and another style.
            colour, style = colours[k % 4], styles[(k + k // 4) % 4]
            size = 1e3 * np.linalg.norm(np.concatenate(evaluation.traces, axis=1), axis=2)
            size = size[np.isfinite(size).any(axis=1)]  # up to where the last episode was lost
            time = TRACE * np.arange(len(size))
            low, middle, high = np.nanquantile(size, (0.05, 0.5, 0.95), axis=1)
            axes.fill_between(time, low, high, color=colour, alpha=0.15, lw=0)
            axes.plot(time, middle, color=colour, ls=style, lw=1.2, label=f"{evaluation.controller} (median, 5-95 %)")
            # Every episode starts without error, which would stretch a logarithmic axis without end.
            lowest = min(lowest, float(np.quantile(low, 0.05)))
        axes.set(xlabel="time (s)", ylabel="tracking error (mm)", yscale="log", title=title)
        axes.set_ylim(bottom=max(lowest / 2, 1e-3))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.legend(loc="lower center", ncol=2)
        return save(figure, folder, "error_over_time")
