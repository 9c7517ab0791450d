"""What it costs to have pieces computed by other processes, two workers, of joblib and of a cluster."""

import time
from typing import Any

from baselines.work.side_by_side import side_by_side
from baselines.work.tasks import Result, Task
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Options, Study, as_found
from lab.engine.tables import markdown

PIECES, LASTS = 200, 0.05
"""Pieces of a measurement, and s that each lasts."""


def wait(seconds: float) -> None:
    """A piece that lasts and computes nothing, so that only what stands around it costs."""
    time.sleep(seconds)


def seconds(cluster: str | None, lasts: float) -> tuple[float, float]:
    """s until the first piece is complete, which is the pool's start, and s per piece after it."""
    ends: list[float] = []
    began = time.perf_counter()
    side_by_side(wait, [(lasts,)] * PIECES, 2, lambda number, result: ends.append(time.perf_counter()), cluster)
    return ends[0] - began, (ends[-1] - ends[0]) / (PIECES - 1)


def overhead(cluster: str) -> Result:
    """s: the start, an empty piece, and one of ``LASTS`` s."""
    start, empty = seconds(cluster or None, 0.0)
    return {"start": start, "empty": empty, "lasting": seconds(cluster or None, LASTS)[1]}


def _tasks(options: Options) -> dict[Any, Task]:
    pools = {"joblib": "", **({"ray": options.beside} if options.beside else {})}
    return {name: Task(name, overhead, {"cluster": cluster}) for name, cluster in pools.items()}


def _shown(content: Content) -> dict[str, str]:
    rows = [["two workers", "start, s", "an empty piece, ms", f"a piece of {1e3 * LASTS:g} ms, ms", "of these over half of it"]]
    for name, found in content["figures"].items():
        times = [f"{1e3 * found['lasting']:.1f}", f"{1e3 * (found['lasting'] - LASTS / 2):.1f}"]
        rows.append([name, f"{found['start']:.2f}", f"{1e3 * found['empty']:.2f}", *times])
    return {"pools.md": markdown(rows) + "\n"}


STUDY = Study(
    {"beside": ""},
    _tasks,
    as_found,
    {"start": "s", "empty": "s", "lasting": "s"},
    _shown,
    timed=True,
    words={"beside": "ray or ray:ADDRESS, measured beside joblib's processes"},
)
register(study="pools", about="what other processes and hosts cost")(STUDY)
