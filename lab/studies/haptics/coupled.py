"""Coupled stability: maps over hands of spring, mass and damper, and the Z-width, by the push of
``lab.studies.stability.maps``.

Z-width is the range of impedances that can be rendered stably (Colgate and Brown 1994): stiffness that is asked for, and
damping in units of the law's own, each against every hand of ``HANDS``. A cell is stable where it is with every rig drawn.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.controller import Controller
from baselines.work.tasks import Result
from lab.studies.haptics.worlds import Condition, condition_of, varies_damping
from lab.studies.stability.maps import Cases, Verdict, judge

STIFFNESSES = (0.0, 100.0, 300.0, 1000.0, 3000.0, 8000.0, 20000.0)
"""N/m, of a hand: none, which leaves a mass alone, to a clamp."""

MASSES = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0)
"""kg, of a hand."""

DAMPINGS = (0.0, 20.0)
"""N s/m, of a hand; assumed: none, and what an arm has at least."""

SETPOINT = 2000.0
"""N/m, while hands vary."""

HANDS = ((0.0, 0.0), (0.0, 2.0), (2000.0, 0.0), (2000.0, 1.0), (20000.0, 0.0), (20000.0, 2.0))
"""N/m and kg, without damping: what the Z-width must be stable against."""

ASKED = (500.0, 1000.0, 2000.0, 4000.0, 6000.0, 8000.0, 12000.0, 20000.0)
"""N/m."""

FACTORS = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Damping in units of the law's own."""


def measure_hands(damping: float, **settings: Any) -> Result:
    """Rows over ``MASSES`` and columns over ``STIFFNESSES`` of hands with a damping, N s/m: the worst of the rigs."""
    condition = condition_of(**settings)
    stiffness, mass = (side.ravel() for side in np.meshgrid(STIFFNESSES, MASSES))
    hands = list(zip(np.full(len(mass), SETPOINT), stiffness, mass, strict=True))
    verdict = _pushed(condition, condition.law(), hands, damping, None)
    shape = (len(MASSES), len(STIFFNESSES), -1)
    return {"damping": damping, **_worst(verdict, shape)}


def measure_z_width(**settings: Any) -> Result:
    """Rows over ``FACTORS``, or the law's own damping alone, and columns over ``ASKED``: the worst of ``HANDS`` and rigs.

    What a law refuses is neither stable nor lost: ``refused`` has its words, and the rest of the cell is null.
    """
    condition = condition_of(**settings)
    law = condition.law()
    factors = FACTORS if varies_damping(law) else (None,)
    cells = list(itertools.product(factors, ASKED))
    refused = [condition.refusal(asked, factor) for factor, asked in cells]
    kept = [k for k, why in enumerate(refused) if why is None]
    found: dict[str, list[Any]] = {name: [None] * len(cells) for name in ("motion_mm", "force", "energy", "stable")}
    if kept:
        hands = [(cells[k][1], *hand) for k in kept for hand in HANDS]
        told = None if factors == (None,) else [cells[k][0] for k in kept for _ in HANDS]
        worst = _worst(_pushed(condition, law, hands, 0.0, told), (len(kept), -1))
        for name, values in worst.items():
            for k, value in zip(kept, values, strict=True):
                found[name][k] = value
    rows = [slice(first, first + len(ASKED)) for first in range(0, len(cells), len(ASKED))]
    return {
        "factors": [factor or 1.0 for factor in factors], "refused": [refused[row] for row in rows],
        **{name: [values[row] for row in rows] for name, values in found.items()},
    }  # fmt: skip


def _pushed(
    condition: Condition, law: Controller, hands: Sequence[tuple[float, ...]], damping: float, factors: Sequence[Any] | None
) -> Verdict:
    """Every rig held by every hand (setpoint, N/m, stiffness, N/m, mass, kg), rigs next to each other: (H x R,) lanes."""
    rigs = condition.drawn()
    asked, stiffness, mass = np.repeat(np.array(hands, dtype=np.float64), len(rigs), axis=0).T
    cases = Cases(rigs * len(hands), stiffness, asked, np.full(len(mass), damping), mass)
    factor = None if factors is None else np.repeat(np.array(factors, dtype=np.float64), len(rigs))
    return judge(cases, law, condition.sensors, condition.seed, factor, condition.force_sensor)


def _worst(verdict: Verdict, shape: tuple[int, ...]) -> Result:
    """Of a verdict over lanes, reshaped to ``shape``, the worst along the last axis; what is lost is null."""
    motion, force, energy = (
        np.where(verdict.lost, np.nan, values) for values in (verdict.motion, verdict.force, verdict.energy)
    )
    named = {"motion_mm": 1e3 * motion, "force": force, "energy": energy}
    worst = {name: values.reshape(shape).max(axis=-1).tolist() for name, values in named.items()}
    return {**worst, "stable": verdict.stable.reshape(shape).all(axis=-1).tolist()}


def stable_up_to(piece: Result) -> list[float]:
    """Per damping factor of a piece of ``measure_z_width``, N/m: the stiffest setpoint up to which, from the softest that is
    not refused, all are stable; 0 if none is."""
    limits = []
    for stable, refused in zip(piece["stable"], piece["refused"], strict=True):
        limit = 0.0
        for asked, good, why in zip(ASKED, stable, refused, strict=True):
            if why is None and not good:
                break
            limit = asked if good else limit
        limits.append(limit)
    return limits
