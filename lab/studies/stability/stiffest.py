"""Where the backstepping laws begin to swing, over rigs and latencies: what ``baselines.backstepping.stiffest`` is made of.

    birthsim study stiffest

Per law and rig: the last of a row of setpoints from 1 to 64 kN/m, each 1.2 times the one before, up to which a push of 40 N
leaves the nominal rig within 20 mm, over m/(tau + latency/4).
"""

import itertools
from typing import Any

from baselines.backstepping.stiffest import PART
from baselines.work.tasks import Task
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import digits, markdown
from lab.studies.stability.swinging import stiffest

MASSES, LAGS, LATENCIES = (1.5, 3.0, 6.0), (0.002, 0.004, 0.008), (0.0, 0.004, 0.012)
"""kg, s and s; without latency positions are exact."""

UNITS = {"controller": "", "mass": "kg", "valve": "s", "latency": "s", "limit": "N/m", "rate": "1/s"}
"""Columns of the figures; no limit (None) where it swings at no setpoint."""


def _tasks(_: Options) -> dict[Any, Task]:
    cases = itertools.product(("backstepping", "backstepping-cartesian"), MASSES, LAGS, LATENCIES)
    return {case: Task("-".join(map(str, case)), stiffest, dict(zip(UNITS, case, strict=False))) for case in cases}


def _kept(_: Options, found: Found) -> Any:
    limits = [(*case, result["limit"]) for case, result in found.items()]
    return [[*row, row[4] and row[4] * (row[2] + PART * row[3]) / row[1]] for row in limits]


def _shown(content: Content) -> dict[str, str]:
    first, *head = [f"{name}, {unit}" if unit else name for name, unit in UNITS.items()]
    rows = [[first, *information.COLUMNS, *head]]
    for name, *values in content["figures"]:
        facts = information.informed(name, "lab", rig=information.TOLD)
        rows.append([name, *facts, *map(_entry, values)])
    return {"stiffest.md": markdown(rows) + "\n"}


def _entry(value: Any) -> str:
    return "-" if value is None else digits(value)


STUDY = Study({}, _tasks, _kept, UNITS, _shown)
register(study="stiffest", about="stiffest setpoints at which the paper's law rests")(STUDY)
