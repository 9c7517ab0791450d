"""The scale of scores: logarithmic in the settled error, 0 for shut valves and 100 for the best classical controller.

``birthsim study scale`` and ``scale-rail`` measure the errors of these two in every task, and write the files beside this one.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.bench.statistics import LOST_ERROR
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each

FILES = [Path(__file__).with_name(name) for name in ("scale.json", "scale_rail.json")]
"""One of each time that suites were measured: a suite that comes later leaves the scale of others as it is."""

LEAST_ERROR = 1e-3
"""mm: a smaller settled error counts as this one. It is a hundredth of what the cameras resolve."""

SHUT, BEST = "shut valves", "best classical"
"""Who has 0 and who has 100."""

_END = {"controller": str, "error_mm": float, "low": float, "high": float, "episodes": int}
_SCHEMA = {"tasks": Each({SHUT: _END, BEST: _END})}


@cache
def _tasks() -> dict[str, Any]:
    return {name: own for file in FILES for name, own in read_json("scale", file, _SCHEMA)["tasks"].items()}


def ends(task: str) -> dict[str, Any] | None:
    """The ends of a task's scale as they were measured: role (``SHUT``, ``BEST``) -> ``controller``, ``error_mm`` with ``low``
    and ``high``, its 95 % interval, and ``episodes``; None for a task that has no scale."""
    return _tasks().get(task)


def counted_error(error: ArrayLike, lost: ArrayLike) -> Array:
    """Settled errors, mm, as a score counts them: within ``LEAST_ERROR`` and ``LOST_ERROR``, which is that of a lost episode.

    NaN, of an episode in which nothing settles, stays.
    """
    values = np.clip(np.asarray(error, dtype=np.float64), LEAST_ERROR, LOST_ERROR)
    return np.where(np.asarray(lost, dtype=np.bool_), LOST_ERROR, values)


def score_of(task: str, error: ArrayLike) -> Array | None:
    """Scores of ``counted_error``s in a task, of the same shape; None where the task has no scale.

    100 log(e0 / e) / log(e0 / e1), where e0 is the error of shut valves and e1 that of the best classical controller.
    """
    if (own := ends(task)) is None:
        return None
    shut, best = (own[role]["error_mm"] for role in (SHUT, BEST))
    return np.asarray(100.0 * np.log(shut / np.asarray(error)) / np.log(shut / best))


def factor_per_point(task: str) -> float:
    """By what factor an error shrinks for one point of score in a task that has a scale."""
    own = _tasks()[task]
    return float((own[SHUT]["error_mm"] / own[BEST]["error_mm"]) ** 0.01)
