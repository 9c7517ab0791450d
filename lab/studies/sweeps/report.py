"""A sweep's results: one row per episode as Parquet, and a table with one row per point."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.metrics import UNITS
from baselines.bench.statistics import number, penalize_lost, summarize
from baselines.work.tasks import Result
from birthsim_env.extras import installation
from lab.engine import information
from lab.engine.tables import markdown
from lab.studies.sweeps.plan import Point

SHOWN_POINTS = 100
"""Rows of the table; the Parquet file has all."""

STATISTICS = ("median", "mean", "q95", "max")


def episodes(points: Sequence[Point], results: Sequence[Sequence[Result]]) -> dict[str, list[Any]]:
    """Column -> values: a row per episode, with what varies, ``point``, ``episode_seed``, ``lost``, ``success``, returns and
    metrics; what an episode says nothing about is NaN."""
    names = list(dict.fromkeys(name for point in points for name in point))
    rows: dict[str, list[Any]] = {name: [] for name in ("point", *names, "episode_seed", "lost", "success", *UNITS)}
    for place, (point, pieces) in enumerate(zip(points, results, strict=True)):
        for piece in pieces:
            count = len(piece["seeds"])
            own = {
                "point": [place] * count, **{name: [point.get(name)] * count for name in names},
                "episode_seed": piece["seeds"], "lost": piece["lost"], "success": piece["success"], **piece["metrics"],
            }  # fmt: skip
            for name, values in own.items():
                rows[name] += [np.nan if value is None and name in UNITS else value for value in values]
            for discount, values in piece["returns"].items():
                rows.setdefault(f"return_{discount}", []).extend(values)
    return rows


def write_parquet(rows: dict[str, list[Any]], path: Path) -> None:
    """The same bytes for the same rows; values of different kinds in one column become text."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise ValueError(f"{error}; sweeps need the extra: {installation('sweep')}") from error
    columns = {}
    for name, values in rows.items():
        try:
            columns[name] = pa.array(values)
        except (pa.ArrowInvalid, pa.ArrowTypeError):
            columns[name] = pa.array([None if value is None else str(value) for value in values])
    pq.write_table(pa.table(columns), path, compression="zstd")


def figures(points: Sequence[Point], results: Sequence[Sequence[Result]]) -> list[dict[str, Any]]:
    """Per point what varies, episodes, lost and successful ones, mean return, and per metric its ``STATISTICS``; a lost
    episode is infinitely bad."""
    found = []
    for point, pieces in zip(points, results, strict=True):
        lost = [one for piece in pieces for one in piece["lost"]]
        paid = [value for piece in pieces for value in piece["returns"]["1.0"]]
        summary = {}
        for metric in UNITS:
            values = [np.nan if v is None else v for piece in pieces for v in piece["metrics"][metric]]
            applies = metric in ("settled_rms", "settled_max_x", "settled_max_y")
            summary[metric] = summarize(penalize_lost(values, lost, applies=applies))
        found.append(
            {
                "point": point,
                "episodes": len(lost),
                "lost": sum(lost),
                "success": sum(one for piece in pieces for one in piece["success"]),
                "return": float(np.mean(paid)) if paid else np.nan,
                "metrics": summary,
            }
        )
    return found


def table(found: Sequence[dict[str, Any]], sensors: str = "ideal") -> str:
    """Markdown of ``figures`` as a result keeps them: what varies, lost episodes, settled error, successes and mean return.

    Where controllers vary, what each is told and senses stands behind it; ``sensors`` are those of points that name none.
    """
    names = list(dict.fromkeys(name for row in found for name in row["point"]))
    head = [one for name in names for one in (name, *(information.COLUMNS if name == "controller" else ()))]
    rows = [[*head, "lost", "settled error, mm: median", "95 %", "largest", "success", "return, mean"]]
    for row in found[:SHOWN_POINTS]:
        point = row["point"]
        varied = []
        for name in names:
            varied.append(short(point.get(name)))
            if name == "controller":
                varied += information.informed_if_registered(point[name], point.get("sensors", sensors))
        error = [number(as_float(row["metrics"]["settled_rms"][key])) for key in ("median", "q95", "max")]
        count = row["episodes"]
        rows.append(
            [
                *varied,
                f"{row['lost']} of {count}",
                *error,
                f"{row['success']} of {count}",
                number(as_float(row["return"])),
            ]
        )
    text = markdown(rows)
    return text if len(found) <= SHOWN_POINTS else f"{text}\n\n{len(found) - SHOWN_POINTS} more points are in episodes.parquet."


def as_float(value: Any) -> float:
    """A figure as a result keeps it: "lost" for infinity, None for none."""
    return float("inf" if value == "lost" else "nan" if value is None else value)


def short(value: Any) -> str:
    """A value in a table or under an axis."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
