"""A row of the benchmark: scores, success on feasible worlds and errors of each task, with intervals, and all tasks together.

Definitions are those of Agarwal et al. 2021 (``rliable``): a run is one training seed; the score of a run in a task is the mean
over its episodes; over all runs and tasks the interquartile mean counts, whose interval comes from a bootstrap that draws runs
anew within each task (stratified). Where there is one run, it draws episodes instead, and says nothing of other seeds.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.bench.feasibility import FEASIBLE
from baselines.bench.statistics import (
    crossed_interval,
    interquartile_mean,
    jsonable,
    number,
    penalize_lost,
    quantile,
    stratified_interval,
)
from baselines.tables import aligned
from baselines.work.tasks import Result
from birthsim.benchmark.suites import BenchmarkTask
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.scores import normalized_score


def task_row(task: BenchmarkTask, runs: Sequence[Result]) -> dict[str, Any]:
    """What runs reached in a task, as JSON takes it; None where there is no scale, or no feasible world."""
    lost, success = (np.array([one[name] for one in runs], dtype=np.bool_) for name in ("lost", "success"))
    feasible = np.array([one["required_strength_ratio"] for one in runs], dtype=np.float64)[0] <= FEASIBLE
    errors = penalize_lost([[np.nan if error is None else error for error in one["errors"]] for one in runs], lost, True)
    scores = scores_of(task, runs)
    return {
        "task": task.name,
        "environment": task.environment,
        "sensors": task.sensors,
        "options": task.options,
        "score": None if scores is None else _estimate(_mean, scores),
        "scores": None if scores is None else scores.mean(axis=1).tolist(),
        "success": _estimate(_mean, success[:, feasible].astype(np.float64)) if feasible.any() else None,
        "feasible": int(feasible.sum()),
        "error_mm": _estimate(_median, errors),
        "lost": lost.sum(axis=1).tolist(),
        "episodes": len(feasible),
        "seconds": [round(one["seconds"], 1) for one in runs],
    }


def scores_of(task: BenchmarkTask, runs: Sequence[Result]) -> Array | None:
    """Normalised scores (runs, episodes) in a task; None where it has no scale."""
    if not task.is_scored:
        return None
    return np.array(normalized_score(task.environment, [one["returns"] for one in runs], task.sensors))


def overall(tasks: Sequence[BenchmarkTask], runs: Sequence[Sequence[Result]]) -> dict[str, Any] | None:
    """All tasks that have a scale together: ``runs`` of each task; None where none has."""
    scores = [own for task, results in zip(tasks, runs, strict=True) if (own := scores_of(task, results)) is not None]
    if not scores:
        return None
    values = np.stack(scores)
    by_run = values.mean(axis=2)
    over = "runs" if by_run.shape[1] > 1 else "episodes"
    interval = (
        stratified_interval(interquartile_mean, by_run)
        if over == "runs"
        else stratified_interval(lambda drawn: interquartile_mean(drawn.mean(axis=1)), values[:, 0])
    )
    return {"iqm": interquartile_mean(by_run), "low": interval[0], "high": interval[1], "over": over, "tasks": len(scores)}


def table(row: dict[str, Any]) -> str:
    """A row for the screen."""
    head = ("task", "score", "success on feasible", "settled error, mm, median", "lost", "s")
    lines = []
    for one in row["tasks"]:
        figures = [_said(one[name], scale, digits) for name, scale, digits in _SHOWN]
        share = f"{figures[1]} of {one['feasible']}" if one["success"] is not None else "-"
        runs = len(one["lost"])
        lost = f"{sum(one['lost'])} of {runs * one['episodes']}"
        lines.append([one["task"], figures[0], share, figures[2], lost, f"{sum(one['seconds']):.0f}"])
    said = [aligned(head, lines)]
    if (whole := row["overall"]) and len(row["tasks"]) > 1:
        over = f"{whole['low']:.1f} to {whole['high']:.1f}"
        said.append(f"score, interquartile mean of {whole['tasks']} tasks: {whole['iqm']:.1f} [{over}], over {whole['over']}")
    return "\n".join(said)


_SHOWN = (("score", 1.0, 1), ("success", 100.0, 0), ("error_mm", 1.0, None))
"""Name, factor and digits of what a table shows; None: three digits."""


def _said(estimate: dict[str, Any] | None, scale: float, digits: int | None) -> str:
    if estimate is None:
        return "-"
    values = [np.inf if one == "lost" else np.nan if one is None else scale * one for one in estimate.values()]
    value, low, high = (number(one) if digits is None or not np.isfinite(one) else f"{one:.{digits}f}" for one in values)
    return f"{value}{' %' if scale != 1.0 else ''} [{low}, {high}]"


def _estimate(statistic: Any, values: Array) -> dict[str, Any]:
    """A statistic of values (runs, episodes) and its 95 % interval over both; "lost" where it is infinite."""
    low, high = crossed_interval(statistic, values)
    found: dict[str, Any] = jsonable({"value": statistic(values), "low": low, "high": high})
    return {name: None if isinstance(one, float) and np.isnan(one) else one for name, one in found.items()}


def _mean(values: Array) -> float:
    return float(np.mean(values))


def _median(values: Array) -> float:
    return quantile(values, 0.5)
