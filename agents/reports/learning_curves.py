"""Learning curves of several training seeds: interquartile mean and 95 % bootstrap interval over the seeds."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baselines.bench.statistics import crossed_interval, interquartile_mean
from baselines.figures.runs import ACCENT, DARK, MIDDLE, STYLE, legend_below, save
from birthsim_env.physics.compiled.lanes import Array

FIGURES = (
    ("pooled_mm", "pooled settled error (mm)"),
    ("tail_mm", "settled error, 95 % quantile (mm)"),
    ("stiffness_error_percent", "error along the push (%)"),
    ("hunting_mm", "hunting (mm)"),
    ("saturation_percent", "time at a valve's limit (%)"),
)
"""Figures of a validation, where they say something."""


def learning_curves(folders: Sequence[Path]) -> list[dict[str, Any]]:
    """What ``training.json`` of each folder says, of those that have one; ``ValueError`` for a damaged one."""
    files = [folder / "training.json" for folder in folders]
    return [_learning_curve(file) for file in files if file.is_file()]


def _learning_curve(file: Path) -> dict[str, Any]:
    try:
        training = dict(json.loads(file.read_text(encoding="utf-8")))
        for figures in (training["law"], *training["curve"]):
            for name, _ in FIGURES:
                _number(figures[name])
        for steps in [training["curve"][0], *training["curve"]]:
            float(steps["steps"])
        str(training["settings"]["environment"])
    except (LookupError, TypeError, ValueError) as error:
        raise ValueError(f"{str(file)!r} is damaged ({error!r}); allowed: a file that birthsim train wrote") from error
    return training


def over_seeds(trainings: Sequence[dict[str, Any]], figure: str) -> tuple[Array, Array]:
    """Steps (T,), and interquartile mean and both ends of its 95 % interval (3, T) of ``figure`` over the trainings.

    Up to where the shortest of them ends. NaN where an interval's figure says nothing.
    """
    length = min(len(training["curve"]) for training in trainings)
    steps = np.array([point["steps"] for point in trainings[0]["curve"][:length]], dtype=np.float64)
    values = np.array(
        [[_number(point[figure]) for point in training["curve"][:length]] for training in trainings], dtype=np.float64
    )
    rows = [
        (interquartile_mean(column), *crossed_interval(interquartile_mean, column[:, None])) if np.isfinite(column).all()
        else (np.nan,) * 3
        for column in values.T
    ]  # fmt: skip
    return steps, np.array(rows).T


def draw_learning_curves(trainings: Sequence[dict[str, Any]], folder: Path) -> list[Path]:
    """Draw ``learning_curves`` (PNG and SVG) with the law as a line; nothing without trainings."""
    if not trainings:
        return []
    curves = [(key, label, *over_seeds(trainings, key)) for key, label in FIGURES]
    said = [curve for curve in curves if np.isfinite(curve[-1]).any()]
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, len(said), figsize=(2.6 * len(said), 3.2), layout="constrained", squeeze=False)
        for axes, (key, label, steps, (middle, low, high)) in zip(panels[0], said, strict=True):
            axes.fill_between(1e-6 * steps, low, high, color=MIDDLE, alpha=0.25, lw=0)
            for training in trainings:
                own = [_number(point[key]) for point in training["curve"]]
                at = [1e-6 * point["steps"] for point in training["curve"]]
                name = "every seed" if training is trainings[0] else None
                axes.plot(at, own, color=ACCENT, lw=0.7, ls=":", label=name)
            axes.plot(1e-6 * steps, middle, color=MIDDLE, lw=1.6, label="interquartile mean, 95 % interval")
            law = [_number(training["law"][key]) for training in trainings]
            axes.axhline(interquartile_mean(law), color=DARK, ls="--", lw=1.0, label="law")
            axes.set(xlabel="policy steps (million)", ylabel=label)
            axes.set_ylim(bottom=0)
        legend_below(figure, *panels[0][0].get_legend_handles_labels())
        environment = trainings[0]["settings"]["environment"]
        figure.suptitle(f"{environment}: validation of {len(trainings)} training seeds", fontsize=9.5)
        return save(figure, folder, "learning_curves")


def draw_side_by_side(trainings: Mapping[str, Sequence[dict[str, Any]]], folder: Path, name: str) -> list[Path]:
    """Draw pooled errors of the trainings of each algorithm over policy steps and over wall time (``name``, PNG and SVG)."""
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 2, figsize=(7.4, 3.0), layout="constrained", sharey=True)
        measures = ("steps", 1e-6, "policy steps (million)"), ("seconds", 1.0, "time (s)")
        for axes, (measure, unit, label) in zip(panels, measures, strict=True):
            for color, (algorithm, own) in zip((ACCENT, MIDDLE), trainings.items(), strict=True):
                for training in own:
                    points = training["curve"][1:]
                    at, error = ([_number(point[key]) for point in points] for key in (measure, "pooled_mm"))
                    axes.plot(unit * np.array(at), error, color=color, lw=1.0, label=algorithm if training is own[0] else None)
            axes.set(yscale="log", xlim=0, xlabel=label)
        panels[0].set_ylabel(dict(FIGURES)["pooled_mm"])
        legend_below(figure, *panels[0].get_legend_handles_labels())
        return save(figure, folder, name)


def _number(value: float | None) -> float:
    """JSON has null for what is not finite."""
    return float("nan") if value is None else float(value)
