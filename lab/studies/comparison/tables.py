"""The bench as Markdown, an overview with one row per controller, and as CSV, with every figure."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from baselines.bench.statistics import number
from lab.engine import information
from lab.engine.tables import SPREAD, SPREAD_AND_WORST, Cell, Head, digits, markdown
from lab.studies.comparison.grid import METRICS, MOVING, RIGS

Figures = Sequence[dict[str, Any]]
"""What ``lab.studies.comparison.grid.statistics`` returns."""

DATA = (
    *("environment", "sensors", "rig", "hand", "metric", "unit", "controller", "median", "low", "high", "q95", "worst"),
    *("ratio", "ratio_low", "ratio_high", "lost", "episodes"),
)
"""Columns of the data file. The first seven say where, what and who. The next five are the median over the episodes with its
95 % interval, the 95th percentile and the worst. Then come the median of the ratios to ``backstepping`` in the same world, with
its interval, and how many of the episodes were lost."""

OWN_HAND = "own"
"""What the data file calls the environment's own hand, which is none of ``MOVING``."""

IN_FULL = (
    *("settled_rms", "settled_max_x", "settled_max_y", "stiffness_error", "cross_motion", "hunting", "air", "saturation"),
    *("valve_turns", "valve_travel"),
)
"""Metrics of the data file; the JSON file holds all."""

SUMMARY = ("median", "low", "high", "q95", "worst")
RATIO = ("ratio", "ratio_low", "ratio_high")
"""Columns of a figure and of its ratio to that of ``backstepping``."""


@dataclass(frozen=True)
class Column:
    """Columns of the overview: a metric under some conditions, its median with an interval or, with ``worst``, the worst.

    ``hand`` is one of ``MOVING``, or "" for the environment's own."""

    title: str
    environment: str
    sensors: str
    plant: str
    metric: str
    worst: bool = False
    hand: str = ""

    @property
    def conditions(self) -> tuple[str, str, str, str]:
        """Environment, sensors, plant and moving hand, as a cell has them."""
        return self.environment, self.sensors, self.plant, self.hand

    @property
    def head(self) -> Head:
        """Its title and statistics."""
        return Head(self.title, ("median", "worst") if self.worst else (INTERVAL,))

    def entry(self, figures: dict[str, Any] | None) -> Cell:
        """What stands below its head."""
        found = figures and figures["metrics"].get(self.metric)
        if not found:
            return "-"
        return [found["median"], found["worst"]] if self.worst else [interval(found)]


INTERVAL = "median [95 % interval]"
CIRCLE, PROBE, FORCEPS = "BirthSIM/Circle-v2", "BirthSIM/Probe-v3", "BirthSIM/Forceps-v2"
COLUMNS = (
    Column("settled error of circles, ideal sensors, mm", CIRCLE, "ideal", "randomised", "settled_rms"),
    Column("settled error of circles, lab sensors, mm", CIRCLE, "lab", "randomised", "settled_rms"),
    Column("stiffness error, ideal sensors, %", PROBE, "ideal", "nominal", "stiffness_error", worst=True),
    Column("stiffness error, lab sensors, %", PROBE, "lab", "nominal", "stiffness_error", worst=True),
    Column("hunting, ideal sensors, mm", PROBE, "ideal", "nominal", "hunting", worst=True),
    Column("hunting, lab sensors, mm", PROBE, "lab", "nominal", "hunting", worst=True),
    Column("air, ideal sensors, l/min", CIRCLE, "ideal", "nominal", "air"),
    Column("air, lab sensors, l/min", CIRCLE, "lab", "nominal", "air"),
    Column("valve turns, lab sensors, 1/s", CIRCLE, "lab", "nominal", "valve_turns"),
    Column("valve travel, lab sensors, 1/s", CIRCLE, "lab", "nominal", "valve_travel"),
    *(
        Column(f"settled error of circles, {hand} hand, lab sensors, mm", CIRCLE, "lab", "randomised", "settled_rms", hand=hand)
        for hand in MOVING
    ),
)


def interval(found: dict[str, Any]) -> str:
    """A median with its 95 % interval."""
    return f"{digits(found['median'])} [{digits(found['low'])}, {digits(found['high'])}]"


def controllers_of(figures: Figures) -> list[str]:
    """The controllers, in the order in which they were asked for."""
    return list(dict.fromkeys(cell["controller"] for cell in figures))


def overview(figures: Figures) -> str:
    """One row per controller; columns whose environment did not run are left out."""
    found = {(cell["controller"], *_place(cell)): cell for cell in figures}
    columns = [column for column in COLUMNS if any(key[1:] == column.conditions for key in found)]
    sensors = list(dict.fromkeys(column.sensors for column in columns))
    heads = [column.head for column in columns]
    rows: list[list[Cell | Head]] = [["controller", *information.COLUMNS, *heads, "lost episodes"]]
    for name in controllers_of(figures):
        row = [f"`{name}`", *information.informed(name, *sensors)]
        entries = [column.entry(found.get((name, *column.conditions))) for column in columns]
        own = [cell for cell in figures if cell["controller"] == name]
        rows.append([*row, *entries, f"{sum(c['lost'] for c in own)} of {sum(c['episodes'] for c in own)}"])
    return markdown(rows, heads, alike=[(row[1], row[3]) for row in rows[1:]])


def losses(figures: Figures) -> str:
    """Lost episodes: one row per controller, one column per environment, over all sensor models and plants."""
    environments = list(dict.fromkeys(cell["environment"] for cell in figures))
    rows = [["lost episodes", *map(_short, environments)]]
    for name in controllers_of(figures):
        row = [f"`{name}`"]
        for environment in environments:
            own = [cell for cell in figures if (cell["controller"], cell["environment"]) == (name, environment)]
            row.append(f"{sum(c['lost'] for c in own)} of {sum(c['episodes'] for c in own)}" if own else "-")
        rows.append(row)
    return markdown(rows)


def settled(figures: Figures) -> str:
    """Settled error, mm, by controller, environment and sensors: median and 95 %, and how many of the episodes were lost."""
    kinds = list(dict.fromkeys((cell["environment"], cell["sensors"]) for cell in figures))
    several = len({environment for environment, _ in kinds}) > 1
    titles = [Head(f"{_short(environment)}, " * several + f"{sensors} sensors", SPREAD) for environment, sensors in kinds]
    found = {(cell["controller"], (cell["environment"], cell["sensors"])): cell for cell in figures}
    names = controllers_of(figures)
    lost_of = "" if several else f", {' and '.join(sensors for _, sensors in kinds)}"
    rows: list[list[Cell | Head]] = [["controller", *information.COLUMNS, *titles, f"lost{lost_of}"]]
    for name in names:
        own = [found[name, kind] for kind in kinds]
        errors = [[cell["metrics"]["settled_rms"][key] for key in ("median", "q95")] for cell in own]
        lost = " and ".join(str(cell["lost"]) for cell in own)
        facts = information.informed(name, *(sensors for _, sensors in kinds))
        rows.append([f"`{name}`", *facts, *errors, f"{lost} of {own[0]['episodes']}"])
    return markdown(rows, titles, alike=[(row[1], row[3]) for row in rows[1:]])


def _short(environment: str) -> str:
    """The environment without prefix and version."""
    return environment.removeprefix("BirthSIM/").rpartition("-")[0]


KINDS = {
    ("ideal", "randomised"): "ideal", ("lab", "randomised"): "lab", ("honest", "described-sensors"): "honest",
    ("honest", "randomised"): "honest, randomised",
}  # fmt: skip
"""Sensors and plant -> what the table of sensors calls them, on randomised rigs."""


def by_sensors(figures: Figures, parameters: str = "") -> str:
    """What sensors cost on randomised rigs: median, 95 % and worst per controller and ``KINDS``, a column per hand; controllers
    believe the rig of a file, ``parameters``."""
    found = {(cell["controller"], *_place(cell)): cell for cell in figures}
    quantities = ["Probe: stiffness error, %", "Probe: hunting, mm", "Probe: settled error, mm", "Circle: settled error, mm"]
    quantities += [f"Circle, {hand} hand: settled error, mm" for hand in MOVING]
    heads = [Head(quantity, SPREAD_AND_WORST) for quantity in quantities]
    rows: list[list[Cell | Head]] = [["controller", *information.COLUMNS, "sensors", *heads, "lost"]]
    columns = [(PROBE, "", metric) for metric in ("stiffness_error", "hunting", "settled_rms")]
    columns += [(CIRCLE, hand, "settled_rms") for hand in ("", *MOVING)]
    for name in controllers_of(figures):
        for kind, words in KINDS.items():
            cells = [found.get((name, environment, *kind, hand)) for environment, hand, _ in columns]
            if None not in cells:
                own = [(cell, metric) for cell, (*_, metric) in zip(cells, columns, strict=True) if cell]
                three = [[cell["metrics"][metric][key] for key in ("median", "q95", "worst")] for cell, metric in own]
                facts = information.informed(name, kind[0], parameters=parameters)
                rows.append([f"`{name}`", *facts, words, *three, str(sum(cell["lost"] for cell, _ in own[2:]))])
    return markdown(rows, heads, alike=[(row[4], row[1], row[3]) for row in rows[1:]])


def data(figures: Figures) -> str:
    """Every figure as CSV with the columns ``DATA``: a row per environment, sensor model, rig, hand, metric and controller."""
    rows: list[Sequence[str]] = [DATA]
    for where in dict.fromkeys(map(_place, figures)):
        here = [cell for cell in figures if _place(cell) == where]
        environment, sensors, plant, hand = where
        place = [environment, sensors, RIGS[plant].removesuffix(" rig"), hand or OWN_HAND]
        for metric in IN_FULL:
            for cell in here:
                if (mine := cell["metrics"].get(metric)) is None:
                    continue
                ratio = cell["ratios"].get(metric)
                values = [mine[key] for key in SUMMARY]
                others = ["", "", ""] if ratio is None else [number(ratio[key]) for key in SUMMARY[:3]]
                count = [str(cell["lost"]), str(cell["episodes"])]
                rows.append([*place, metric, METRICS[metric], cell["controller"], *map(number, values), *others, *count])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _place(cell: dict[str, Any]) -> tuple[str, ...]:
    return cell["environment"], cell["sensors"], cell["plant"], cell.get("hand", "")
