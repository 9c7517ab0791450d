"""Recovery: rigs drawn at random, an experiment on each, and what comes back of their parameters."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from baselines.backstepping.controller import BacksteppingController
from baselines.identification.experiment import Plan, propose
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.work.tasks import Result, Task
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.rig.parameters import Parameters, value_of

_DOCUMENTED = documented_ranges(Parameters(), "honest")
RANGES: dict[str, tuple[float, float]] = {
    **{
        name: _DOCUMENTED[name]
        for name in (
            "cylinder1.coulomb_friction", "cylinder1.pressure_friction", "cylinder1.viscous_friction",
            "cylinder2.coulomb_friction", "cylinder2.pressure_friction", "cylinder2.viscous_friction",
            "friction.bristle_stiffness", "mechanics.mass", "chambers.dead_volume", "chambers.wall_heat_transfer",
            "valves.time_constant", "valves.supply_overlap", "valves.supply_curvature", "valves.exhaust_overlap",
            "valves.exhaust_curvature", "electronics.position_latency", "electronics.position_noise",
            "electronics.pressure_noise",
        )
    },
    "friction.static_ratio": (1.1, 1.6),
    "friction.stribeck_speed": (0.008, 0.03),
    "friction.bristle_damping": (80.0, 250.0),
    "valves.sonic_conductance": (2.9e-9, 4.9e-9),
    "valves.critical_ratio": (0.2, 0.4),
    "valves.leakage_ratio": (0.002, 0.012),
}  # fmt: skip
"""What is drawn: the documented ranges, the stiffness of bristles by its logarithm, and for the rest ranges about the default,
assumed."""

SENSORS = "lab"


def drawn_rig(seed: int) -> Parameters:
    """The rig of a seed."""
    return draw_parameters(Parameters(), RANGES, stream(seed, 0, "parameters"))


EXPERIMENTS: dict[str, Callable[[Plan], Plan]] = {
    "proposed": lambda plan: plan,
    "target": lambda plan: replace(plan, added=np.zeros_like(plan.added)),
    "rest": lambda plan: replace(
        plan, target=plan.target[:, :1].repeat(len(plan.times), axis=1), added=np.zeros_like(plan.added)
    ),
}
"""What a log is of: the proposed experiment, its target alone without added openings, or a target at rest."""


def recover(seed: int, duration: float, experiment: str) -> Result:
    """One rig: an experiment of ``EXPERIMENTS`` under a law that believes in the default rig, and the identification from that
    rig on."""
    owner, rig = Parameters(), drawn_rig(seed)
    plan = EXPERIMENTS[experiment](propose(owner, duration, seed))
    trial = run_plan(plan, [rig], BacksteppingController(owner), SENSORS, seed)[0]
    found = identify(trial, owner, seed)
    rows = {
        row.name: {
            "true": value_of(rig, row.name),
            "value": row.value,
            "low": row.low,
            "high": row.high,
            "told": row.determined,
        }
        for row in found.rows
    }
    return {"rows": rows, "misfit": list(found.misfit)}


def recovery_tasks(rigs: int, seed: int, duration: float, experiment: str) -> list[Task]:
    """A piece per rig, with seeds from ``seed`` on."""
    settings = {"duration": duration, "experiment": experiment}
    return [Task(f"{experiment}_{k}", recover, {"seed": k, **settings}) for k in range(seed, seed + rigs)]
