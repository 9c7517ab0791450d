"""Figures of runs: the paper's Fig. 4, one episode, and errors of controllers over time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from baselines.bench.evaluation import Evaluation
from baselines.bench.measures import TRACE
from baselines.bench.statistics import number
from baselines.figures.style import (
    COLOURS,
    COLUMN,
    DARK,
    LIGHT,
    MIDDLE,
    PAGE,
    STYLE,
    headline,
    label_of,
    legend_below,
    look,
    save,
)
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.reward import SETTLED


def figure4(record: dict[str, Array], folder: Path) -> list[Path]:
    """The paper's Fig. 4 from a run: ``record`` holds ``info`` fields over time, (T,) or (T, 2), SI units."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(PAGE, 5.6), layout="constrained")
        _setpoints(axes[0, 0], record)
        _pneumatic(axes[0, 1], record)
        _path(axes[1, 0], record)
        _coordinates(axes[1, 1], record)
        for panel in (axes[0, 0], axes[0, 1], axes[1, 1]):
            panel.xaxis.set_major_locator(MultipleLocator(4))
        off = 1e3 * np.linalg.norm(record["tracking_error"], axis=1)[record["since_jump"] >= SETTLED]
        rms = np.sqrt(np.mean(off**2)) if off.size else np.nan
        headline(
            figure, f"Fig. 4: {SETTLED:g} s after a jump the end effector is within {rms:.2g} mm RMS of its compliant target"
        )
        return save(figure, folder, "figure4")


def _described(axes: Axes, letter: str, title: str) -> None:
    """Title above a panel, its legend below."""
    axes.set_title(f"({letter}) {title}")
    axes.legend(ncol=3, loc="upper center", bbox_to_anchor=(0.5, -0.2), handlelength=1.8, columnspacing=1.2)


def _setpoints(axes: Axes, record: dict[str, Array]) -> None:
    time = record["time"]
    axes.plot(time, record["user_force"][:, 0], color=DARK, label="$F_{us,x}$")
    axes.plot(time, record["user_force"][:, 1], color=MIDDLE, ls="--", label="$F_{us,y}$")
    axes.set(xlabel="time (s)", ylabel="user force (N)")
    axes.set_ylim(-60, 45)
    right = axes.twinx()
    right.plot(time, record["stiffness_setpoint"][:, 0], color=LIGHT, lw=2)
    right.set(ylabel="stiffness setpoint (N/m)", ylim=(0, 9000))
    right.set_yticks(range(0, 9000, 2000))
    right.grid(False)
    right.spines["right"].set_visible(True)
    axes.plot([], color=LIGHT, lw=2, label="$K_{clx} = K_{cly}$ (right)")
    _described(axes, "a", "User force, closed-loop stiffness setpoint")


def _pneumatic(axes: Axes, record: dict[str, Array]) -> None:
    for k, colour, style in ((0, DARK, "-"), (1, MIDDLE, "--")):
        axes.plot(record["time"], record["pneumatic_stiffness"][:, k], color=colour, ls=style, label=f"$K_{{pneu{k + 1}}}$")
    setpoints = axes.plot(record["time"], record["pneumatic_stiffness_setpoint"], color="black", ls=":", lw=1.5)
    setpoints[0].set_label("setpoints")
    axes.set(xlabel="time (s)", ylabel="pneumatic stiffness (N/m)", ylim=(0, 6000))
    _described(axes, "b", "Pneumatic stiffness")


def _path(axes: Axes, record: dict[str, Array]) -> None:
    half = record["stiffness_setpoint"][:, 0] <= np.median(np.unique(record["stiffness_setpoint"][:, 0]))
    target = 1e3 * record["target"]
    axes.plot(target[:, 0], target[:, 1], color="black", ls=":", lw=1.2, label="target")
    for chosen, colour, style, name in ((half, LIGHT, "-", "softer half"), (~half, MIDDLE, "--", "stiffer half")):
        position = 1e3 * record["position"][chosen]
        axes.plot(position[:, 0], position[:, 1], color=colour, ls=style, label=name)
    axes.set(xlabel="$x_c$ (mm)", ylabel="$y_c$ (mm)")
    axes.set_aspect("equal")
    _described(axes, "c", "Path of the end effector")


def _coordinates(axes: Axes, record: dict[str, Array]) -> None:
    centre = 1e3 * record["target"].mean(axis=0)
    for field, colour, style, width, label in (
        ("target", "black", ":", 1.2, "target"),
        ("compliant_target", LIGHT, "-", 2.5, "compliant target (19)"),
        ("position", MIDDLE, "-", 0.9, "end effector"),
    ):
        moved = 1e3 * record[field] - centre + (75.0, -75.0)
        axes.plot(record["time"], moved, color=colour, ls=style, lw=width)[0].set_label(label)
    axes.set(xlabel="time (s)", ylabel="coordinate less its mean (mm)", ylim=(-145, 145))
    axes.set_yticks([-125, -75, -25, 25, 75, 125], ["−50", "$y$ 0", "50", "−50", "$x$ 0", "50"])
    _described(axes, "d", "Coordinates")


def episode_figure(episode: dict[str, Array], title: str, folder: Path) -> list[Path]:
    """``episode.png`` and ``.svg`` from rows of time (s), positions and errors (m) and the hand's force (N), each (T, 2)."""
    time, size = episode["time"], 1e3 * np.linalg.norm(episode["tracking_error"], axis=1)
    with plt.rc_context(STYLE):
        figure, (path, error, force) = plt.subplots(1, 3, figsize=(PAGE, 2.8), layout="constrained")
        for name, colour, style in (("compliant_target", MIDDLE, "--"), ("position", DARK, "-")):
            path.plot(*(1e3 * episode[name].T), color=colour, ls=style, label=name.replace("_", " "))
        path.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
        error.plot(time, size, color=DARK)
        error.set(xlabel="time (s)", ylabel="tracking error (mm)")
        for k, (axis, style) in enumerate((("x", "-."), ("y", ":"))):
            force.plot(time, episode["user_force"][:, k], color=COLOURS[k + 2], ls=style, label=f"force along {axis}")
        force.set(xlabel="time (s)", ylabel="force of the hand (N)")
        pull = np.linalg.norm(episode["user_force"], axis=1).max()
        rms = np.sqrt(np.mean(size**2))
        headline(figure, f"Error of {rms:.2g} mm RMS, {size.max():.2g} mm at most, under up to {pull:.0f} N")
        legend_below(figure, said=title)
        return save(figure, folder, "episode")


def _smallest(evaluations: Sequence[Evaluation]) -> str:
    """The metric that ``birthsim evaluate`` prints, of the controller with the smallest."""
    medians = {label_of(one.controller): one.settled_error()["median"] for one in evaluations}
    known = {name: median for name, median in medians.items() if not np.isnan(median)}
    if not known:  # a hand that jumps all the time
        return "Error over time; nothing settled"
    best = min(known, key=known.__getitem__)
    if np.isinf(known[best]):
        return "Error over time; most episodes were lost"
    kind = "smallest median" if len(evaluations) > 1 else "median"
    return f"{best}: {kind} of the settled error, {number(known[best])} mm"


def error_over_time(evaluations: Sequence[Evaluation], caption: str, folder: Path) -> list[Path]:
    """Size of the tracking error over time: median and 5-95 % band over the episodes, one line per controller."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(COLUMN, 3.2), layout="constrained")
        lowest = np.inf
        for k, evaluation in enumerate(evaluations):
            style = look(k)
            size = 1e3 * np.linalg.norm(np.concatenate(evaluation.traces, axis=1), axis=2)
            size = size[np.isfinite(size).any(axis=1)]  # up to where the last episode was lost
            time = TRACE * np.arange(len(size))
            low, middle, high = np.nanquantile(size, (0.05, 0.5, 0.95), axis=1)
            axes.fill_between(time, low, high, color=style["color"], alpha=0.15, lw=0)
            axes.plot(time, middle, **style, lw=0.8, markevery=max(len(time) // 8, 1), label=label_of(evaluation.controller))
            # Every episode starts without error, which would stretch a logarithmic axis without end.
            lowest = min(lowest, float(np.quantile(low, 0.05)))
        axes.set(xlabel="time (s)", ylabel="tracking error (mm)", yscale="log")
        axes.set_ylim(bottom=max(lowest / 2, 1e-3))
        axes.yaxis.set_major_formatter("{x:g}")
        headline(figure, _smallest(evaluations))
        legend_below(figure, said=f"median, 5 to 95 %: {caption}")
        return save(figure, folder, "error_over_time")
