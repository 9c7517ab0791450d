"""Recovery: rigs drawn at random, an experiment on each, and what comes back of their parameters."""

from __future__ import annotations

from typing import Any

import numpy as np

from baselines.bench.statistics import quantile
from baselines.identification.experiment import propose
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.identification.quantities import QUANTITIES, value_of
from baselines.registry import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.parts.drawn.randomization import draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.rig.parameters import Parameters, field_of

RANGES: dict[str, tuple[float, float]] = {
    **{
        name: field_of(name).metadata["randomized"]
        for name in (
            "cylinder1.coulomb_friction", "cylinder1.viscous_friction", "cylinder2.coulomb_friction",
            "cylinder2.viscous_friction", "mechanics.mass", "chambers.dead_volume", "chambers.wall_heat_transfer",
            "valves.time_constant", "electronics.position_latency", "electronics.position_noise", "electronics.pressure_noise",
        )
    },
    "friction.static_ratio": (1.1, 1.6),
    "friction.stribeck_speed": (0.008, 0.03),
    "friction.bristle_stiffness": (3e4, 8e4),
    "friction.bristle_damping": (80.0, 250.0),
    "valves.sonic_conductance": (2.9e-9, 4.9e-9),
    "valves.critical_ratio": (0.2, 0.4),
    "valves.leakage_ratio": (0.002, 0.012),
}  # fmt: skip
"""What is drawn, uniformly: the documented ranges, and for the rest ranges about the default; assumed."""

CONTROLLER, SENSORS = "backstepping", "lab"


def drawn_rig(seed: int) -> Parameters:
    """The rig of a seed."""
    return draw_parameters(Parameters(), RANGES, stream(seed, 0, "parameters"))


def recover(seed: int, duration: float) -> Result:
    """One rig: the experiment under a law that believes in the default rig, and the identification from that rig on."""
    owner, rig = Parameters(), drawn_rig(seed)
    plan = propose(owner, duration, seed)
    trial = run_plan(plan, [rig], make_controller(CONTROLLER, owner), SENSORS, seed)[0]
    found = identify(trial, owner, seed)
    rows = {
        row.name: {
            "true": value_of(rig, row.name), "value": row.value, "low": row.low, "high": row.high, "told": row.told,
        } for row in found.rows
    }  # fmt: skip
    return {"rows": rows, "misfit": list(found.misfit)}


def recovery_tasks(rigs: int, seed: int, duration: float) -> list[Task]:
    """A piece per rig, with seeds from ``seed`` on."""
    return [Task(f"rig_{k}", "rigs", recover, {"seed": k, "duration": duration}) for k in range(seed, seed + rigs)]


def recovery_table(results: list[dict[str, Any]]) -> list[str]:
    """Markdown: per parameter how many rigs' logs tell it, and of these error and interval."""
    lines = [
        "| parameter | drawn from | told in | error: median | 95 % | largest | half interval: median | true value inside |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in QUANTITIES:
        rows = [result["rows"][one.name] for result in results]
        told = [row for row in rows if row["told"]]
        low, high = RANGES[one.name]
        scale, unit, digits = (1e3, "ms", 2) if one.unit else (100.0, "%", 2)
        errors = [scale * abs(row["value"] - row["true"]) / (1.0 if one.unit else row["true"]) for row in told]
        halves = [scale * 0.5 * (row["high"] - row["low"]) / (1.0 if one.unit else row["true"]) for row in told]
        cells = [quantile(np.array(errors), f) for f in (0.5, 0.95, 1.0)] + [quantile(np.array(halves), 0.5)]
        inside = sum(row["low"] <= row["true"] <= row["high"] for row in told)
        written = " | ".join(f"{cell:.{digits}g} {unit}" for cell in cells)
        ranges = f"{low:g} to {high:g} {field_of(one.name).metadata['unit']}"
        lines.append(f"| `{one.name}` | {ranges} | {len(told)} of {len(rows)} | {written} | {inside} of {len(told)} |")
    return lines
