"""Learning curves of several training seeds: interquartile mean and 95 % bootstrap interval over the seeds."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baselines.bench.statistics import crossed_interval, interquartile_mean
from baselines.figures.style import ACCENT, COLUMN, DARK, MIDDLE, STYLE, headline, legend_below, log_ticks, look, save
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Listed

METRICS = (
    ("pooled_mm", "settled error (mm)"),
    ("tail_mm", "95th percentile (mm)"),
    ("stiffness_error_percent", "stiffness error (%)"),
    ("hunting_mm", "hunting (mm)"),
    ("saturation_percent", "valves saturated (%)"),
)
"""Metrics of a validation, where they say something."""

_VALIDATION = {name: (float, None) for name, _ in METRICS}
_TRAINING = {
    "settings": {"environment": str},
    "law": _VALIDATION,
    "curve": Listed({"steps": float, **_VALIDATION}, 1),
    "policy?": {"pooled_mm": (float, None), "tail_mm": (float, None), "lost": int},
}
"""What a training leaves; null stands for what is not finite."""


def learning_curves(folders: Sequence[Path]) -> list[dict[str, Any]]:
    """What ``training.json`` of each folder says, of those that have one; ``ValueError`` for a damaged one."""
    files = [folder / "training.json" for folder in folders]
    return [read_json("policy", file, _TRAINING) for file in files if file.is_file()]


def over_seeds(trainings: Sequence[dict[str, Any]], metric: str) -> tuple[Array, Array]:
    """Steps (T,), and interquartile mean and both ends of its 95 % interval (3, T) of ``metric`` over the trainings.

    Up to where the shortest of them ends. NaN where an interval says nothing.
    """
    length = min(len(training["curve"]) for training in trainings)
    steps = np.array([point["steps"] for point in trainings[0]["curve"][:length]], dtype=np.float64)
    values = np.array(
        [[_number(point[metric]) for point in training["curve"][:length]] for training in trainings], dtype=np.float64
    )
    rows = [
        (interquartile_mean(column), *crossed_interval(interquartile_mean, column[:, None]))
        if np.isfinite(column).all()
        else (np.nan,) * 3
        for column in values.T
    ]
    return steps, np.array(rows).T


def draw_learning_curves(trainings: Sequence[dict[str, Any]], folder: Path) -> list[Path]:
    """Draw ``learning_curves`` (PNG and SVG) with the law as a line; nothing without trainings."""
    if not trainings:
        return []
    curves = [(key, label, *over_seeds(trainings, key)) for key, label in METRICS]
    said = [curve for curve in curves if np.isfinite(curve[-1]).any()]
    with plt.rc_context(STYLE):
        rows = -(-len(said) // 2)
        size = COLUMN, 1.5 * rows + 0.9
        figure, panels = plt.subplots(rows, min(len(said), 2), figsize=size, layout="constrained", squeeze=False, sharex=True)
        for axes in panels.flat[len(said) :]:
            axes.set_visible(False)
        for k, (axes, (key, label, steps, (middle, low, high))) in enumerate(zip(panels.flat, said, strict=False)):
            axes.fill_between(1e-6 * steps, low, high, color=MIDDLE, alpha=0.25, lw=0)
            for training in trainings:
                own = [_number(point[key]) for point in training["curve"]]
                at = [1e-6 * point["steps"] for point in training["curve"]]
                axes.plot(at, own, color=ACCENT, lw=0.7, ls=":", label="every seed")
            axes.plot(1e-6 * steps, middle, color=MIDDLE, label="interquartile mean, 95 % interval")
            law = [_number(training["law"][key]) for training in trainings]
            axes.axhline(interquartile_mean(law), color=DARK, ls="--", label="without the policy")
            axes.set(title=label, ylim=(0, None))
            if k + panels.shape[1] >= len(said):
                axes.set_xlabel("policy steps (million)")
                axes.tick_params(labelbottom=True)
        key, label, _, (middle, *_) = said[0]
        before = interquartile_mean([_number(training["law"][key]) for training in trainings])
        name, _, unit = label.rpartition(" ")
        headline(figure, f"Training changes the {name} from {before:.2g} to {middle[-1]:.2g} {unit.strip('()')}")
        legend_below(figure, said=f"{trainings[0]['settings']['environment']}, {len(trainings)} training seeds")
        return save(figure, folder, "learning_curves")


def draw_side_by_side(trainings: Mapping[str, Sequence[dict[str, Any]]], folder: Path, name: str) -> list[Path]:
    """Draw pooled errors of the trainings of each algorithm over policy steps and over wall time (``name``, PNG and SVG)."""
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 2, figsize=(COLUMN, 2.2 + 0.17 * len(trainings)), layout="constrained", sharey=True)
        measures, finals = (("steps", 1e-6, "policy steps (million)"), ("seconds", 1.0, "time (s)")), dict[str, list[float]]()
        for axes, (measure, unit, label) in zip(panels, measures, strict=True):
            for k, (algorithm, own) in enumerate(trainings.items()):
                for training in own:
                    points = training["curve"][1:]
                    at, error = ([_number(point[key]) for point in points] for key in (measure, "pooled_mm"))
                    axes.plot(unit * np.array(at), error, label=algorithm, **look(k, markers=False))
                    finals.setdefault(algorithm, []).append(error[-1])
            axes.set(yscale="log", xlim=0, xlabel=label)
        log_ticks(panels[0].yaxis, 1.0, 3.0)
        panels[0].set_ylabel(dict(METRICS)["pooled_mm"])
        reached = ", ".join(f"{algorithm} {np.median(errors):.2g} mm" for algorithm, errors in finals.items())
        headline(figure, f"Settled error reached: {reached}")
        legend_below(figure, said="a line for every training seed")
        return save(figure, folder, name)


def _number(value: float | None) -> float:
    """JSON has null for what is not finite."""
    return float("nan") if value is None else float(value)
