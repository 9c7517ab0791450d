"""Where the backstepping laws begin to swing, over rigs and latencies: what ``baselines.backstepping.stiffest`` is made of.

    birthsim study stiffest

Per law and rig: the last of a row of setpoints from 1 to 64 kN/m, each 1.2 times the one before, up to which a push of 40 N
leaves the nominal rig within 20 mm, over m/(tau + latency/4).
"""

from __future__ import annotations

import itertools
from typing import Any, cast

import numpy as np

from baselines.backstepping.stiffest import PART
from baselines.registry import make_controller
from baselines.staged import StagedController
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters
from studies.comparison.tables import markdown
from studies.results import Content
from studies.stability.maps import Cases, judge
from studies.study import Found, Options, Study

MASSES, LAGS, LATENCIES = (1.5, 3.0, 6.0), (0.002, 0.004, 0.008), (0.0, 0.004, 0.012)
"""kg, s and s; without latency positions are exact."""

ASKED = np.array([1000.0 * 1.2**step for step in range(24)])

SWING = 0.02
"""m, peak to peak."""


UNITS = {"controller": "", "mass": "kg", "valve": "s", "latency": "s", "limit": "N/m", "rate": "1/s"}
"""Columns of the figures; no limit (None) where it swings at no setpoint."""


def _tasks(_: Options) -> dict[Any, Task]:
    cases = itertools.product(("backstepping", "backstepping-cartesian"), MASSES, LAGS, LATENCIES)
    return {case: Task("-".join(map(str, case)), case[0], stiffest, dict(zip(UNITS, case, strict=False))) for case in cases}


def stiffest(controller: str, mass: float, valve: float, latency: float) -> Result:
    """``limit`` of a controller on a rig, N/m, infinite where it swings nowhere."""
    rig = {"mechanics.mass": mass, "valves.time_constant": valve, "electronics.position_latency": latency}
    return {"limit": rests_up_to(controller, Parameters().replace(rig), "lab" if latency else "ideal")}


def _kept(_: Options, found: Found) -> Any:
    limits = [(*case, result["limit"]) for case, result in found.items()]
    return [[*row, row[4] and row[4] * (row[2] + PART * row[3]) / row[1]] for row in limits]


def _shown(content: Content) -> dict[str, str]:
    head = [f"{name}, {unit}" if unit else name for name, unit in UNITS.items()]
    return {"stiffest.md": markdown([head, *([_entry(value) for value in row] for row in content["figures"])]) + "\n"}


def _entry(value: Any) -> str:
    return "-" if value is None else value if isinstance(value, str) else f"{value:.4g}"


def rests_up_to(name: str, rig: Parameters, sensors: str) -> float:
    """N/m: the last of ``ASKED`` before the first at which the law swings, without its own bound; infinite where none does."""
    law, still = cast(StagedController, make_controller(name, rig)), np.zeros(len(ASKED))
    stages = law.law_stages
    law.law_stages = lambda sampled: stages(sampled)[1:]  # type: ignore[method-assign]
    verdict = judge(Cases([rig] * len(ASKED), still, ASKED, still, still), law, sensors, 0, None)
    swings = verdict.lost | (verdict.motion > SWING)
    return float(ASKED[max(int(np.argmax(swings)) - 1, 0)]) if swings.any() else np.inf


STUDY = Study((__name__,), {}, _tasks, _kept, UNITS, _shown)
