"""Each training seed of an entry in a task, beside entries that learned nothing."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.bench.statistics import number, quantile
from birthsim.benchmark.row import LOST
from lab.engine.tables import markdown
from lab.studies.leaderboard.records import Known


def seeds(task: str, name: str, beside: Sequence[str], known: Known) -> str:
    """Settled errors in the feasible worlds of a ``task``: a row for each seed of the entry ``name``, and for those ``beside``.

    *Training* is the time on the clock of the machine that trained, with validation.
    """
    rows = [["policy or controller", "training, s", "median, mm", "95 %, mm", "largest, mm", "lost"]]
    for own in (name, *beside):
        said = known[own]
        row = next(one for one in said["tasks"] if one["task"] == task)
        for policy, training, errors in zip(said["policies"], said["training"], row["errors"], strict=True):
            rows.append([f"`{policy}`", number(training["seconds"]) if training else "-", *_errors(errors, row["infeasible"])])
    return markdown(rows)


def _errors(errors: Sequence[Any], infeasible: Sequence[int]) -> list[str]:
    """Median, 95th percentile, largest and how many are lost, which count as infinite."""
    own = [error for k, error in enumerate(errors) if k not in infeasible]
    values = np.array([np.inf if one == LOST else np.nan if one is None else one for one in own])
    return [*(number(quantile(values, share)) for share in (0.5, 0.95, 1.0)), f"{own.count(LOST)} of {len(own)}"]
