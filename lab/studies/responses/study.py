"""Frequency responses of the rig with shut valves: from hand and valves to position, and from valves to stiffness.

Sliding and stuck pistons at a low and a high pneumatic stiffness, with the resonance and the bandwidth of every curve. Spools
move about the ends of their overlap.
"""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.statistics import number
from baselines.work.tasks import Result, Task
from birthsim_env import Parameters, balanced_pressures, linearize
from birthsim_env.gradients.linear.model import LinearModel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown

FREQUENCY = np.geomspace(0.05, 200, 2000)
"""Hz."""

DRAWN = 10
"""Every so many of them are drawn."""

REFERENCE = int(np.searchsorted(FREQUENCY, 0.5))
"""Where responses are compared with, 0.5 Hz: slow enough for the air to act as a spring, quick enough for leakage to have no
time."""

STIFFNESS = {"low": (3500.0, 1900.0), "high": (5200.0, 2700.0)}
"""N/m of the cylinders, as (9) counts it."""

FRICTION = ("sliding", "stuck")
"""What the pistons do."""

_VALVES = Parameters().valves
EDGES = {
    f"valves.{side}_{name}": value
    for side, d, c in (
        ("supply", _VALVES.supply_overlap, _VALVES.supply_curvature),
        ("exhaust", _VALVES.exhaust_overlap, _VALVES.exhaust_curvature),
    )
    for name, value in (("overlap", 0.0), ("curvature", (1 + c) / (1 - d) - 1))
}
"""Valves that have, when shut, the gain of the default rig's where these leave their overlap, (1 + c)/(1 - d). Within it those
have none."""

CURVES: dict[str, tuple[str, float, str, dict[str, float], bool]] = {
    "hand Fx to x": ("mm/N", 1e3, "x", {"Fx": 1.0}, False),
    "hand Fy to y": ("mm/N", 1e3, "y", {"Fy": 1.0}, False),
    "valves 2, opposed, to x": ("mm/%", 10.0, "x", {"u2P": 1.0, "u2N": -1.0}, True),
    "valves 2, together, to K2": ("N/mm/%", 1e-5, "K2", {"u2P": 1.0, "u2N": 1.0}, True),
}
"""Unit, factor from SI, output, how the inputs move, and whether the rig integrates: the figures are then of the output's
rate."""


def measure(title: str, pose: list[float]) -> Result:
    """One of ``CURVES`` with every friction and stiffness: ``size`` at 0.5 Hz in its unit, ``resonance``, Hz, and its ``peak``,
    ``bandwidth``, Hz, and what is drawn: ``magnitude`` and ``phase``, degrees."""
    _, factor, output, inputs, integrates = CURVES[title]
    rig, found = Parameters().replace(EDGES), []
    for friction, name in product(FRICTION, STIFFNESS):
        model = linearize(rig, pose, balanced_pressures(rig, pose, STIFFNESS[name]), friction=friction)
        answer = factor * response(model, output, inputs)
        size = np.abs(2 * np.pi * FREQUENCY * answer if integrates else answer)
        resonance, peak = resonance_of(size) or (None, None)
        phase = np.degrees(np.unwrap(np.angle(answer)))
        found.append(
            {
                "friction": friction,
                "stiffness": name,
                "size": float(size[REFERENCE]),
                "resonance": resonance,
                "peak": peak,
                "bandwidth": bandwidth_of(size),
                "magnitude": _listed(np.abs(answer)),
                "phase": _listed(phase),
            }
        )
    return {"curves": found}


def response(model: LinearModel, output: str, inputs: dict[str, float]) -> Any:
    """Complex response of an output to inputs that move together, (F,), SI."""
    row = [signal.name for signal in model.outputs].index(output)
    weights = np.array([inputs.get(signal.name, 0.0) for signal in model.inputs])
    return (model.frequency_response(FREQUENCY) @ weights)[:, row]


def resonance_of(size: Array) -> tuple[float, float] | None:
    """Frequency, Hz, and height, relative to 0.5 Hz, of the largest peak of a response's size (F,); None below 1.2.

    Air that turns from isothermal to adiabatic stiffens without resonance; that alone is a hump of a tenth.
    """
    best = REFERENCE + 1 + int(np.argmax(size[REFERENCE + 1 :]))
    height = float(size[best] / size[REFERENCE])
    return (float(FREQUENCY[best]), height) if height > 1.2 else None


def bandwidth_of(size: Array) -> float:
    """Last frequency, Hz, up to which a response's size (F,) stays above 0.71 of that at 0.5 Hz."""
    below = np.flatnonzero(size[REFERENCE:] < np.sqrt(0.5) * size[REFERENCE])
    return float(FREQUENCY[REFERENCE + below[0]] if len(below) else FREQUENCY[-1])


def _listed(values: Array) -> list[float]:
    return [float(f"{value:.5g}") for value in values[::DRAWN]]


def _tasks(options: Options) -> dict[Any, Task]:
    return {
        title: Task(f"response_{k}", measure, {"title": title, "pose": list(options.pose)}) for k, title in enumerate(CURVES)
    }


def _kept(options: Options, found: Found) -> Any:
    return {title: result["curves"] for title, result in found.items()}


def _shown(content: Content) -> dict[str, str]:
    rows = [["response", "pistons", "stiffness", "at 0.5 Hz", "resonance, Hz", "peak", "bandwidth, Hz"]]
    for title, curves in content["figures"].items():
        unit, *_, integrates = CURVES[title]
        for one in curves:
            peak = ["none", ""] if one["resonance"] is None else [number(one["resonance"]), number(one["peak"])]
            size = f"{number(one['size'])} {unit}{'/s' * integrates}"
            rows.append([title, one["friction"], one["stiffness"], size, *peak, number(one["bandwidth"])])
    return {"responses.md": markdown(rows) + "\n"}


def _drawn(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.responses.figure import responses_figure

    return responses_figure(content["figures"], folder)


STUDY = Study(
    {"pose": (0.5, 0.0)},
    _tasks,
    _kept,
    {"resonance": "Hz", "bandwidth": "Hz", "phase": "degrees"},
    _shown,
    _drawn,
    words={"pose": "end effector x and y, m"},
)
register(study="responses", about="frequency responses of the rig, and their resonances")(STUDY)
