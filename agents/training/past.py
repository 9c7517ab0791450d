"""What the checkpoint of a training says of its past, and the check that it can be one, before anything is made of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.files import FORMAT as POLICY
from agents.policy.sealed import unsealed
from agents.training.checkpoint import ALLOWED
from agents.training.configuration import TrainingSettings
from agents.training.validation import METRICS
from birthsim_env.physics.rig.schema import Each, Listed, fault
from birthsim_env.physics.rig.values import shown

COUNT = range(2**62)

VALIDATED: dict[str, Any] = {**dict.fromkeys(METRICS, float), "infeasible": COUNT, "lost": COUNT}
"""A validation; errors are NaN where it has no feasible lane."""

POINT = {**VALIDATED, "steps": COUNT, "seconds": float, "environment_fraction": float, "split": Each(float)}
"""Of a learning curve."""

REACHED = {"law": VALIDATED, "policy": (dict, None), "paper": (dict, None), "curve": Listed(POINT)}
PAST = {"reached": REACHED, "due": float, "best": object, "seconds": float, "events": Each(COUNT)}


def checked_past(past: dict[str, Any], settings: TrainingSettings, path: Path) -> dict[str, Any]:
    """The ``past`` that a checkpoint at ``path`` of a training with these ``settings`` says.

    Raises ``ValueError`` that names the file, what in it cannot be, and what is allowed there.
    """
    if complaint := _complaint(past, settings):
        raise ValueError(f"{str(path)!r} does not fit this version ({complaint}); {ALLOWED}")
    return past


def _complaint(past: dict[str, Any], settings: TrainingSettings) -> str:
    if said := fault(past, PAST, "past"):
        return said
    reached = past["reached"]
    for name in ("policy", "paper"):
        if reached[name] is not None and (said := fault(reached[name], VALIDATED, f"past.reached.{name}")):
            return said
    for name, value, most in (("due", past["due"], settings.steps), ("seconds", past["seconds"], math.inf)):
        if not (0 <= value <= most and math.isfinite(value)):
            return f"past.{name} = {shown(value)}; allowed: a number from 0{'' if most == math.inf else f' to {most}'}"
    if (reached["paper"] is None) != (settings.until >= 100):
        wanted = "null" if reached["paper"] is not None else "an object"
        return f"past.reached.paper = {shown(reached['paper'])}; allowed: {wanted}, since until = {settings.until:g}"
    return _complaint_of_best(past["best"], reached)


def _complaint_of_best(best: Any, reached: dict[str, Any]) -> str:
    """The best policy so far: none before the first validation, then the content of its file."""
    if not (isinstance(best, np.ndarray) and best.dtype == np.uint8 and best.ndim == 1):
        return f"past.best = {shown(best)}; allowed: bytes, (N,) of uint8"
    there = {"best": bool(best.size), "reached.policy": reached["policy"] is not None, "reached.curve": bool(reached["curve"])}
    if len({*there.values()}) > 1:
        words = ", ".join(f"past.{name} is {'there' if one else 'empty'}" for name, one in there.items())
        return f"{words}; allowed: all or none of them"
    if best.size:
        try:
            unsealed(best.tobytes(), POLICY)
        except ValueError as error:
            return f"past.best is {error}; allowed: the content of a policy's file"
    return ""
