"""A row of the benchmark: scores, success and errors of each task on its feasible worlds, with intervals, and tasks together.

Definitions are those of Agarwal et al. 2021 (``rliable``): a run is one training seed; the score of a run in a task is the mean
over its episodes; over all runs and tasks the interquartile mean counts, whose interval comes from a bootstrap that draws runs
anew within each task (stratified). Where there is one run, it draws episodes instead, and says nothing of other seeds.
"""

from collections.abc import Mapping, Sequence
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
from birthsim.benchmark.scale import counted_error, score_of
from birthsim.benchmark.suites import BenchmarkTask
from birthsim_env.physics.compiled.lanes import Array

LOST = "lost"
"""What stands in place of a lost episode's error."""


def task_row(task: BenchmarkTask, runs: Sequence[Result]) -> dict[str, Any]:
    """What runs reached in a task, as JSON takes it; None where there is no scale, or no feasible world."""
    lost, success = (np.array([one[name] for one in runs], dtype=np.bool_) for name in ("lost", "success"))
    feasible = np.array([one["required_strength_ratio"] for one in runs], dtype=np.float64)[0] <= FEASIBLE
    each = penalize_lost([[np.nan if error is None else error for error in one["errors"]] for one in runs], lost, True)
    row = {
        "task": task.name,
        "environment": task.environment,
        "sensors": task.sensors,
        "options": task.options,
        "episodes": len(feasible),
        "infeasible": np.flatnonzero(~feasible).tolist(),
        "errors": [[None if np.isnan(error) else jsonable(float(error)) for error in run] for run in each],
    }
    scores = scores_of(row)
    any_feasible = bool(feasible.any())
    return {
        **row,
        "score": _estimate(_mean, scores[:, feasible]) if scores is not None and any_feasible else None,
        "scores": np.nanmean(scores, axis=1).tolist() if scores is not None and any_feasible else None,
        "success": _estimate(_mean, success[:, feasible].astype(np.float64)) if any_feasible else None,
        "error_mm": _estimate(_median, each[:, feasible]) if any_feasible else None,
        "lost": lost[:, feasible].sum(axis=1).tolist(),
        "returns": [float(np.mean(one["returns"])) for one in runs],
        "seconds": [round(one["seconds"], 1) for one in runs],
    }


def scores_of(row: Mapping[str, Any]) -> Array | None:
    """Scores (runs, episodes) from the ``errors`` of a task's row, NaN in worlds beyond the rig; None without a scale."""
    lost = np.array([[error == LOST for error in run] for run in row["errors"]])
    each = np.array([[np.nan if error in (LOST, None) else error for error in run] for run in row["errors"]], dtype=np.float64)
    scores = score_of(row["task"], counted_error(each, lost))
    if scores is not None:
        scores[:, row["infeasible"]] = np.nan
    return scores


def overall(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """Rows of tasks together, of those that have a score; None where none has."""
    scores = [own for one in rows if one["score"] is not None and (own := scores_of(one)) is not None]
    if not scores:
        return None
    values = np.stack(scores)
    by_run = np.nanmean(values, axis=2)
    over = "runs" if by_run.shape[1] > 1 else "episodes"
    interval = (
        stratified_interval(interquartile_mean, by_run)
        if over == "runs"
        else stratified_interval(lambda drawn: interquartile_mean(np.nanmean(drawn, axis=1)), values[:, 0])
    )
    return {"iqm": interquartile_mean(by_run), "low": interval[0], "high": interval[1], "over": over, "tasks": len(scores)}


def table(row: dict[str, Any]) -> str:
    """A row for the screen."""
    head = ("task", "score", "success", "settled error, mm, median", "lost", "feasible", "s")
    lines = []
    for one in row["tasks"]:
        metrics = [said(one[name], *how) for name, how in SHOWN.items()]
        feasible = one["episodes"] - len(one["infeasible"])
        lost = f"{sum(one['lost'])} of {len(one['lost']) * feasible}"
        lines.append([one["task"], *metrics, lost, f"{feasible} of {one['episodes']}", f"{sum(one['seconds']):.0f}"])
    text = [aligned(head, lines)]
    if (whole := row["overall"]) and len(row["tasks"]) > 1:
        over = f"{whole['low']:.1f} to {whole['high']:.1f}"
        text.append(f"score, interquartile mean of {whole['tasks']} tasks: {whole['iqm']:.1f} [{over}], over {whole['over']}")
    return "\n".join(text)


SHOWN: dict[str, tuple[float, int | None]] = {"score": (1.0, 1), "success": (100.0, 0), "error_mm": (1.0, None)}
"""Estimate of a task's row -> factor and digits of what a table shows; None: three digits."""


def said(estimate: Mapping[str, Any] | None, factor: float, digits: int | None) -> str:
    """An estimate with its interval for a table."""
    if estimate is None:
        return "-"
    values = [np.inf if one == LOST else np.nan if one is None else factor * one for one in estimate.values()]
    value, low, high = (number(one) if digits is None or not np.isfinite(one) else f"{one:.{digits}f}" for one in values)
    return f"{value}{' %' if factor != 1.0 else ''} [{low}, {high}]"


def _estimate(statistic: Any, values: Array) -> dict[str, Any]:
    """A statistic of values (runs, episodes) and its 95 % interval over both; "lost" where it is infinite."""
    low, high = crossed_interval(statistic, values)
    found: dict[str, Any] = jsonable({"value": statistic(values), "low": low, "high": high})
    return {name: None if isinstance(one, float) and np.isnan(one) else one for name, one in found.items()}


def _mean(values: Array) -> float:
    """Of what is a number, NaN where nothing is."""
    known = values[~np.isnan(values)]
    return float(np.mean(known)) if known.size else float("nan")


def _median(values: Array) -> float:
    return quantile(values, 0.5)
