"""Evaluations as CSV: a row per metric and controller."""

import csv
import io
from collections.abc import Sequence

import numpy as np

from baselines.bench.evaluation import Evaluation
from baselines.bench.metrics import UNITS
from baselines.bench.statistics import number

DATA = ("metric", "unit", "controller", "value", "q95", "max")
"""Columns: the median over the episodes, their 95th percentile and the largest; of lost and successful episodes the number."""


def data(evaluations: Sequence[Evaluation]) -> str:
    """CSV with the columns ``DATA``; metrics of which the environment says nothing are left out, "lost" is infinite."""
    summaries = [evaluation.summary() for evaluation in evaluations]
    rows: list[Sequence[str]] = [DATA]
    for name, unit in UNITS.items():
        if all(np.isnan(summary[name]["max"]) for summary in summaries):
            continue
        for evaluation, summary in zip(evaluations, summaries, strict=True):
            rows.append([name, unit, evaluation.controller, *(number(summary[name][key]) for key in ("median", "q95", "max"))])
    for name, field in (("lost episodes", "lost"), ("successful episodes", "success")):
        for one in evaluations:
            values = getattr(one, field)
            rows.append([name, f"of {len(values)}", one.controller, str(sum(values)), "", ""])
    for one in evaluations:
        rows.append(["return, mean", "", one.controller, f"{np.mean(one.returns[1.0] or [np.nan]):.4g}", "", ""])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
