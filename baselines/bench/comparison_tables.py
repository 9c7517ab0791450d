"""The bench in Markdown: an overview, one row per controller, and the figures of every environment, sensor model and plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from baselines.bench.comparison import METRICS, MOVING, REFERENCE, known
from baselines.bench.statistics import number

Figures = Sequence[dict[str, Any]]
"""What ``baselines.bench.comparison.statistics`` returns."""

IN_FULL = ("settled_rms", "settled_max_x", "settled_max_y", "stiffness_error", "cross_motion", "hunting", "air", "saturation")
"""Metrics of the full tables; the JSON file holds all."""


@dataclass(frozen=True)
class Column:
    """A column of the overview: a metric under some conditions; with ``worst`` beside its median, or the ratio instead.

    ``hand`` is one of ``MOVING``, or "" for the environment's own."""

    title: str
    environment: str
    sensors: str
    plant: str
    metric: str
    kind: str = "metrics"
    worst: bool = False
    hand: str = ""

    @property
    def conditions(self) -> tuple[str, str, str, str]:
        """Environment, sensors, plant and moving hand, as a cell has them."""
        return self.environment, self.sensors, self.plant, self.hand

    def text(self, figures: dict[str, Any]) -> str:
        """The entry of one cell."""
        found = figures[self.kind].get(self.metric)
        if found is None:
            return "1" if self.kind == "ratios" else "-"
        return f"{number(found['median'])}; {number(found['worst'])}" if self.worst else interval(found)


CIRCLE, PROBE = "BirthSIM/Circle-v1", "BirthSIM/Probe-v2"
COLUMNS = (
    Column("circle: settled error, mm", CIRCLE, "ideal", "randomised", "settled_rms"),
    Column(f"over {REFERENCE}", CIRCLE, "ideal", "randomised", "settled_rms", "ratios"),
    Column("the same, lab sensors, mm", CIRCLE, "lab", "randomised", "settled_rms"),
    Column("rendered stiffness off by, % (median; worst)", PROBE, "ideal", "nominal", "stiffness_error", worst=True),
    Column("the same, lab sensors", PROBE, "lab", "nominal", "stiffness_error", worst=True),
    Column("hunting, mm (median; worst)", PROBE, "ideal", "nominal", "hunting", worst=True),
    Column("the same, lab sensors", PROBE, "lab", "nominal", "hunting", worst=True),
    Column("air, l/min", CIRCLE, "ideal", "nominal", "air"),
    *(
        Column(f"circle, {hand} hand, lab sensors: settled error, mm", CIRCLE, "lab", "randomised", "settled_rms", hand=hand)
        for hand in MOVING
    ),
)


def interval(found: dict[str, Any]) -> str:
    """A median with its 95 % interval."""
    return f"{number(found['median'])} [{number(found['low'])}, {number(found['high'])}]"


def controllers_of(figures: Figures) -> list[str]:
    """The controllers, in the order in which they were asked for."""
    return list(dict.fromkeys(cell["controller"] for cell in figures))


def overview(figures: Figures) -> str:
    """One row per controller; columns whose environment did not run are left out."""
    found = {(cell["controller"], *_place(cell)): cell for cell in figures}
    columns = [column for column in COLUMNS if any(key[1:] == column.conditions for key in found)]
    rows = [["controller", *(column.title for column in columns), "lost episodes"]]
    for name in controllers_of(figures):
        row = [name]
        for column in columns:
            cell = found.get((name, *column.conditions))
            row.append("-" if cell is None else column.text(cell))
        own = [cell for cell in figures if cell["controller"] == name]
        rows.append([*row, f"{sum(c['lost'] for c in own)} of {sum(c['episodes'] for c in own)}"])
    return markdown(rows)


def losses(figures: Figures) -> str:
    """Lost episodes: one row per controller, one column per environment, over all sensor models and plants."""
    environments = list(dict.fromkeys(cell["environment"] for cell in figures))
    rows = [["lost episodes", *environments]]
    for name in controllers_of(figures):
        row = [name]
        for environment in environments:
            own = [cell for cell in figures if (cell["controller"], cell["environment"]) == (name, environment)]
            row.append(f"{sum(c['lost'] for c in own)} of {sum(c['episodes'] for c in own)}" if own else "-")
        rows.append(row)
    return markdown(rows)


def full(figures: Figures) -> str:
    """A section per environment, sensor model, plant and moving hand, with a row per metric and controller."""
    sections = []
    for where in dict.fromkeys(map(_place, figures)):
        here = [cell for cell in figures if _place(cell) == where]
        rows = [["metric", "controller", "median [95 % interval]", "95 %", "worst", f"over {REFERENCE} [95 % interval]"]]
        for metric in IN_FULL:
            for cell in here:
                mine, ratio = cell["metrics"].get(metric), cell["ratios"].get(metric)
                if mine is not None:
                    tail = [number(mine["q95"]), number(mine["worst"]), "" if ratio is None else interval(ratio)]
                    rows.append([f"{metric}, {METRICS[metric]}", cell["controller"], interval(mine), *tail])
        for cell in here:
            rows.append(["lost episodes", cell["controller"], f"{cell['lost']} of {cell['episodes']}", "", "", ""])
        hand = f", moving hand: {where[3]}" if where[3] else ""
        sections.append(f"## {where[0]}, {known(*where[1:3])}{hand}\n\n{markdown(rows)}")
    return "\n\n".join(sections)


def _place(cell: dict[str, Any]) -> tuple[str, ...]:
    return cell["environment"], cell["sensors"], cell["plant"], cell.get("hand", "")


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A table whose first row is its head."""
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
