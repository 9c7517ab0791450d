"""Figure of the integrator's error: against the step, a panel per motion, and against the cost of a millisecond."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from baselines.figures.style import COLUMN, LINES, STYLE, headline, legend_below, log_ticks, look, save
from birthsim_env.physics.compiled.lanes import Array
from lab.engine.tables import digits
from lab.studies.accuracy.errors import ADAPTIVE, EVALUATIONS

LOST = 1e5
"""um: at a tenth of a metre it is another motion, whatever the number; unstable runs are drawn there."""


def accuracy_figure(found: dict[str, Any], folder: Path) -> list[Path]:
    """Errors that ``bench.accuracy.errors.measure`` found: median and range over the rigs, adaptive methods beside."""
    names = list(found["motions"])
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(2, len(names), figsize=(COLUMN, 5.2), layout="constrained", squeeze=False)
        for k, name in enumerate(names):
            _against_step(panels[0, k], found, name)
            _against_cost(panels[1, k], found, name)
        for row in panels:
            low, high = min(axes.get_ylim()[0] for axes in row), max(axes.get_ylim()[1] for axes in row)
            for axes in row:
                axes.set_ylim(low, high)
            row[0].set_ylabel("largest error of position (µm)")
        methods = found["motions"][names[0]]["methods"]
        present = np.argmin(np.abs(np.array(found["steps_s"]) - found["present_step_s"]))
        errors = {name: float(np.median(_micrometres(one["position_m"])[present])) for name, one in methods.items()}
        said = ", ".join(f"{digits(error)} µm ({name})" for name, error in errors.items())
        headline(figure, f"Errors at a step of {1e3 * found['present_step_s']:.3g} ms, {names[0]}: {said}")
        legend_below(figure)
        return save(figure, folder, "accuracy")


def _micrometres(position: Any) -> Array:
    """Errors of position, um, at most ``LOST``; None, of JSON, counts as unstable."""
    micrometres = 1e6 * np.array(position, dtype=float)
    return np.minimum(np.where(np.isnan(micrometres), np.inf, micrometres), LOST)


def _against_step(axes: Axes, found: dict[str, Any], name: str) -> None:
    """Every fixed-step method: median line and band over the rigs that met no end stop."""
    measured = found["motions"][name]
    clear, steps = np.array(measured["clear_of_stops"]), 1e3 * np.array(found["steps_s"])
    for k, (method, values) in enumerate(measured["methods"].items()):
        position = _micrometres(values["position_m"])[:, clear]
        style = look(k)
        axes.fill_between(steps, position.min(axis=1), position.max(axis=1), color=style["color"], alpha=0.15, lw=0)
        axes.plot(steps, np.median(position, axis=1), **style, label=f"{method}, range of rigs")
    axes.axvline(1e3 * found["present_step_s"], color="black", ls=LINES[3], label="the plant's step")
    axes.set(xscale="log", yscale="log", xlabel="step (ms)")
    axes.set_title(f"{name}: {clear.sum()} rigs")
    axes.set_xticks(steps[::2], [f"{step:.2g}" for step in steps[::2]], minor=False)
    axes.minorticks_off()


def _against_cost(axes: Axes, found: dict[str, Any], name: str) -> None:
    """Fixed steps and adaptive methods on the first rig, against evaluations of the right-hand side."""
    measured, steps = found["motions"][name], np.array(found["steps_s"])
    for k, (method, values) in enumerate(measured["methods"].items()):
        position = _micrometres(values["position_m"])[:, 0]
        axes.plot(1e-3 * EVALUATIONS[method] / steps, position, **look(k))
    for k, method in enumerate(ADAPTIVE):
        rows = [row for row in measured["adaptive"] if row["method"] == method]
        position = _micrometres([row["position_m"] for row in rows])
        style = look(k + 3)
        axes.plot([row["evaluations_per_ms"] for row in rows], position, **style, label=f"{method}, adaptive")
    axes.set(xscale="log", yscale="log", xlabel="evaluations per ms (-)")
    axes.set_title(f"{name}: {found['rigs'][0]} rig")
    log_ticks(axes.xaxis, 1.0, 3.0)
