"""The returns as Markdown, an overview with one row per environment and condition, and as CSV, with every controller."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from baselines.bench.measures import DISCOUNTS
from baselines.bench.statistics import number
from baselines.named import uncontrolled_names
from birthsim_env.scores import BEST, ROLES, SHUT
from lab.engine import information
from lab.engine.tables import markdown

DATA = (
    *("scenario", "sensors", "rig", "controller", "normalised return", "error, mm", "success, %", "lost, %"),
    *(f"return at {discount:g}" for discount in DISCOUNTS),
)
"""Columns of the data file: who, where; settled error, median over episodes; mean return of an episode per discount."""


@dataclass(frozen=True)
class Scored:
    """A scenario under one sensor model on one kind of rig: controller -> its figures, and role (``ROLES``) -> who plays it."""

    scenario: str
    sensors: str
    rig: str
    rows: dict[str, dict[str, Any]]
    roles: dict[str, dict[str, Any]]

    @property
    def shown_rig(self) -> str:
        """The kind of rig as tables call it."""
        return self.rig.replace("drawn", "randomised")

    def normalised(self, controller: str) -> int:
        """0 for shut valves, 100 for the best controller."""
        low, high = (float(self.roles[role]["return"]) for role in (SHUT, BEST))
        return round(100 * (float(self.rows[controller]["returns"]["1.0"]) - low) / (high - low))


def overview(found: Sequence[Scored]) -> str:
    """Scores of the ``ROLES``, with names where the role does not say who plays it; "-" where nobody does."""
    rows = [["scenario", "sensors", "rig", *(role for role in ROLES if role != SHUT)]]
    for one in found:
        row = [one.scenario, one.sensors, one.shown_rig]
        for role in ROLES:
            if role == SHUT:
                continue
            if role not in one.roles:
                row.append("-")
                continue
            name = one.roles[role]["controller"]
            row.append(f"{one.normalised(name)}, {name}" if role.startswith("best") else str(one.normalised(name)))
        rows.append(row)
    return markdown(rows)


def informed(found: Sequence[Scored]) -> str:
    """What each controller and policy of the ``overview`` is told and senses."""
    rows = [["controller", *information.COLUMNS]]
    sensors: dict[str, list[str]] = {}
    for one in found:
        for own in one.roles.values():
            policy, _, seed = own["controller"].partition(" ")
            sensors.setdefault(f"residual:{policy}" if seed else policy, []).append(one.sensors)
    for name, kinds in sensors.items():
        if name not in uncontrolled_names():
            rows.append([name, *information.informed(name, *kinds)])
    return markdown(rows)


def data(found: Sequence[Scored]) -> str:
    """Every controller under every condition as CSV with the columns ``DATA``, the worst first."""
    table: list[Sequence[object]] = [DATA]
    for one in found:
        for name, row in sorted(one.rows.items(), key=lambda item: item[1]["returns"]["1.0"]):
            error = "lost" if row["error"] is None else number(row["error"])
            paid = [f"{row['returns'][str(discount)]:.4g}" for discount in DISCOUNTS]
            share = [f"{100 * row[key]:.0f}" for key in ("success", "lost")]
            table.append([one.scenario, one.sensors, one.shown_rig, name, one.normalised(name), error, *share, *paid])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(table)
    return text.getvalue()
