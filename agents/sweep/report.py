"""A sweep's results: one row per episode as Parquet, a table with one row per point, and heat maps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Patch

from agents.sweep.plan import HeatMap, Point
from baselines.bench.comparison_tables import markdown
from baselines.bench.metrics import UNITS
from baselines.bench.statistics import jsonable, number, penalize_lost, summarize
from baselines.bench.tasks import Result
from baselines.figures.runs import STYLE, legend_below, save
from birthsim_env.physics.lanes import Array

SHOWN_POINTS = 500
"""Rows of the table; the Parquet file has all."""

STATISTICS = ("median", "mean", "q95", "max")

LOST_COLOUR = "#303030"


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
        raise ValueError(f"{error}; sweeps need the extra: pip install 'birthsim[sweep]'") from error
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
        found.append({
            "point": point, "episodes": len(lost), "lost": sum(lost),
            "success": sum(one for piece in pieces for one in piece["success"]),
            "return": float(np.mean(paid)) if paid else np.nan, "metrics": summary,
        })  # fmt: skip
    return found


def table(found: Sequence[dict[str, Any]]) -> str:
    """Markdown: what varies, lost episodes, settled error, successes and mean return."""
    names = list(dict.fromkeys(name for row in found for name in row["point"]))
    head = [*names, "lost", "settled error, mm: median", "95 %", "largest", "success", "return, mean"]
    rows = [head]
    for row in found[:SHOWN_POINTS]:
        varied = [_short(row["point"].get(name)) for name in names]
        error = [number(row["metrics"]["settled_rms"][key]) for key in ("median", "q95", "max")]
        count = row["episodes"]
        rows.append([
            *varied, f"{row['lost']} of {count}", *error, f"{row['success']} of {count}", number(row["return"]),
        ])  # fmt: skip
    text = markdown(rows)
    return text if len(found) <= SHOWN_POINTS else f"{text}\n\n{len(found) - SHOWN_POINTS} more points are in episodes.parquet."


def draw_map(number_of: int, chart: HeatMap, found: Sequence[dict[str, Any]], folder: Path) -> list[Path]:
    """Cells coloured by the figure, the mean over what else varies, for values on a grid; coloured points for drawn ones."""
    panels = list(dict.fromkeys(row["point"].get(chart.per) for row in found)) if chart.per else [None]
    with plt.rc_context({**STYLE, "axes.grid": False}):
        figure, axes = plt.subplots(
            1, len(panels), figsize=(max(4.6, 3.7 * len(panels)), 4.0), layout="constrained", sharey=True, squeeze=False
        )
        shown = [[row for row in found if not chart.per or row["point"].get(chart.per) == panel] for panel in panels]
        values = [[row["metrics"][chart.metric][chart.statistic] for row in rows] for rows in shown]
        finite = [value for panel in values for value in panel if np.isfinite(value)]
        low, high = (min(finite), max(finite)) if finite else (0.0, 1.0)
        drawn, lost = None, False
        for place, panel, rows, figure_of in zip(axes[0], panels, shown, values, strict=True):
            x, y = (_numbers([row["point"].get(side) for row in rows]) for side in (chart.x, chart.y))
            size = np.array(figure_of)
            lost |= bool(np.isinf(size).any())
            drawn = _panel(place, x, y, size, low, high)
            place.set(xlabel=chart.x, title="" if panel is None else f"{chart.per} = {_short(panel)}")
        axes[0, 0].set_ylabel(chart.y)
        if drawn is not None:
            unit = UNITS[chart.metric]
            figure.colorbar(drawn, ax=axes, pad=0.015).set_label(f"{chart.metric}, {chart.statistic} ({unit})")
        if lost:
            legend_below(figure, [Patch(color=LOST_COLOUR)], ["infinite: so many episodes were lost"])
        return save(figure, folder, f"map_{number_of}")


def _panel(axes: Any, x: Array, y: Array, size: Array, low: float, high: float) -> Any:
    across, up = np.unique(x), np.unique(y)
    axes.set_facecolor(LOST_COLOUR)
    if len(across) * len(up) > len(size):
        axes.set_facecolor("white")
        axes.scatter(x[np.isinf(size)], y[np.isinf(size)], color=LOST_COLOUR, marker="x")
        return axes.scatter(
            x, y, c=np.where(np.isinf(size), np.nan, size), vmin=low, vmax=high, cmap="YlOrBr", ec="0.4", lw=0.4
        )
    cells = np.full((len(up), len(across)), np.nan)
    for i, row in enumerate(up):
        for j, column in enumerate(across):
            cells[i, j] = size[(x == column) & (y == row)].mean()
    cells[np.isinf(cells)] = np.nan
    drawn = axes.pcolormesh(range(len(across) + 1), range(len(up) + 1), cells, vmin=low, vmax=high, cmap="YlOrBr", ec="white")
    axes.set_xticks(np.arange(len(across)) + 0.5, [f"{value:.4g}" for value in across])
    axes.set_yticks(np.arange(len(up)) + 0.5, [f"{value:.4g}" for value in up])
    return drawn


def summary_json(found: Sequence[dict[str, Any]]) -> Any:
    """``figures`` as JSON takes them; "lost" where a figure is infinite."""
    return jsonable(list(found))


def _numbers(values: Sequence[Any]) -> Array:
    """Values as coordinates; words by the order in which they come."""
    if all(isinstance(value, (int, float)) for value in values):
        return np.array(values, dtype=float)
    order = {value: float(k) for k, value in enumerate(dict.fromkeys(map(str, values)))}
    return np.array([order[str(value)] for value in values])


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
