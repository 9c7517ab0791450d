"""What learned entries take off the errors of the controllers that they correct."""

from typing import Any

import numpy as np

from baselines.bench.statistics import crossed_interval
from birthsim.benchmark.row import scores_of
from birthsim.benchmark.scale import factor_per_point
from birthsim.benchmark.suites import TASKS
from birthsim_env.physics.compiled.lanes import Array
from lab.engine.tables import markdown
from lab.studies.leaderboard import who
from lab.studies.leaderboard.records import Known


def gains(known: Known) -> str:
    """A table of the tasks that an entry and the controller that it corrects both have.

    The change is that of the geometric mean of settled errors over the feasible worlds, with a 95 % bootstrap interval that
    draws training seeds and worlds anew; both drive the same worlds.
    """
    rows = [["task", "entry", "corrects", "change of the error, %", "each seed"]]
    for name, said in known.items():
        law = known.get(str(who.settings(said).get("law")))
        of_law = {one["task"]: one for one in law["tasks"]} if law else {}
        for one in said["tasks"]:
            if law and (its := of_law.get(one["task"])):
                change = _change(one, its)
                low, high = crossed_interval(np.mean, change)
                whole, *ends = (_percent(value) for value in (change.mean(), low, high))
                each = ", ".join(_percent(value) for value in change.mean(axis=1))
                rows.append([f"`{one['task']}`", f"`{name}`", f"`{law['entry']}`", f"{whole} [{', '.join(ends)}]", each])
    order = {task: k for k, task in enumerate(TASKS)}
    return markdown([rows[0], *sorted(rows[1:], key=lambda row: (order[row[0].strip("`")], row[1]))])


def _change(one: dict[str, Any], other: dict[str, Any]) -> Array:
    """By how much the logarithms of an entry's errors are above those of a controller: (seeds, feasible worlds)."""
    own, its = scores_of(one), scores_of(other)
    assert own is not None, one["task"]
    assert its is not None, one["task"]
    change = -np.log(factor_per_point(one["task"])) * (own - its)
    return np.asarray(change[:, np.isfinite(change[0])])


def _percent(change: float) -> str:
    return f"{100.0 * np.expm1(change):+.0f}"
