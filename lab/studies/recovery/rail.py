"""Randomised benches of one cylinder, each identified from a log of its own with an encoder at the rod.

The owner knows how a bench is inclined, and its bore and stroke; experiment, controller and identification take the default
rig for the rest. Dry friction is compared at 2.5 bar above atmosphere in both chambers: a log tells the sum of its two parts
more exactly than each, as one of them grows with the pressures.
"""

import math
from typing import Any

from baselines.backstepping.controller import BacksteppingController
from baselines.bench.statistics import quantile
from baselines.identification.experiment import propose
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.work.tasks import Result, Task
from birthsim_env.parts.drawn.randomization import draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.rig.parameters import Parameters, value_of
from birthsim_env.physics.rig.topology import RAIL, TOPOLOGIES
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown
from lab.studies.recovery.tasks import RANGES

BENCHES = {
    name: drawn for name, drawn in RANGES.items() if TOPOLOGIES[RAIL].has(name) and name != "electronics.position_latency"
}
"""What is drawn of a bench beside its inclination; the latency of an encoder is looked for and not drawn."""

STEEPEST = math.pi / 2
"""rad: inclinations are uniform from 0 on."""

PRESSED = 5e5
"""Pa above atmosphere, both chambers together, at which dry friction is compared."""

ASKED = {"mechanics.mass": "mass", "dry": "dry friction at 2.5 bar", "cylinder2.viscous_friction": "viscous friction"}
"""Rows of the table that the largest errors are asked of, first; then all others that are found."""


def bench_of(seed: int) -> tuple[Parameters, Parameters]:
    """The bench of a seed, as its owner knows it and as it is."""
    random = stream(seed, 0, "parameters")
    owner = Parameters().replace({"linkage.kind": RAIL, "linkage.inclination": float(random.uniform(0.0, STEEPEST))})
    return owner, draw_parameters(owner, BENCHES, random)


def recover_bench(seed: int, duration: float, sensors: str) -> Result:
    """One bench: the proposed experiment under a law that believes in the default rig, and what is found of it."""
    owner, bench = bench_of(seed)
    plan = propose(owner, duration, seed)
    trial = run_plan(plan, [bench], BacksteppingController(owner), sensors, seed)[0]
    found = identify(trial, owner, seed)
    rows = {
        row.name: {
            "true": value_of(bench, row.name),
            "value": row.value,
            "low": row.low,
            "high": row.high,
            "told": row.determined,
        }
        for row in found.rows
    }
    dry = {"true": _dry(bench), "value": _dry(found.rig), "told": True}
    return {"rows": rows | {"dry": dry}, "misfit": list(found.misfit), "law": found.rig.friction.law}


def _dry(rig: Parameters) -> float:
    return rig.cylinder2.coulomb_friction + PRESSED * rig.cylinder2.pressure_friction


def _tasks(options: Options) -> dict[Any, Task]:
    settings = {"duration": options.duration, "sensors": options.sensors}
    return {
        seed: Task(f"bench_{seed}", recover_bench, {"seed": seed, **settings})
        for seed in range(options.seed, options.seed + options.rigs)
    }


def _kept(options: Options, found: Found) -> Any:
    if not found:
        raise ValueError(f"none of {options.rigs} benches was identified")
    return [{"seed": seed, **result} for seed, result in found.items()]


def _shown(content: Content) -> dict[str, str]:
    found, settings = content["figures"], content["settings"]
    head = (
        f"{len(found)} of {settings['rigs']} benches, seeds from {settings['seed']}, logs of {settings['duration']:g} s, "
        f"`{settings['sensors']}`."
    )
    lines = [
        ["parameter", "told in", "error: median", "95th percentile", "largest", "half interval: median", "true value inside"]
    ]
    names = [*ASKED, *(name for name in found[0]["rows"] if name not in ASKED)]
    lines += [_line(name, [result["rows"][name] for result in found if name in result["rows"]]) for name in names]
    return {"recovery-rail.md": f"{head}\n\n{markdown(lines)}\n"}


def _line(name: str, rows: list[dict[str, Any]]) -> list[str]:
    told = [row for row in rows if row["told"]]
    late = name.endswith("latency")
    unit, scales = ("ms", [1e3] * len(told)) if late else ("%", [100.0 / row["true"] for row in told])
    errors = [scale * abs(row["value"] - row["true"]) for scale, row in zip(scales, told, strict=True)]
    cells = [f"{quantile(errors, part):.2g} {unit}" for part in (0.5, 0.95, 1.0)]
    word = ASKED.get(name, f"`{name}`")
    if "low" not in rows[0]:
        return [word, f"{len(told)} of {len(rows)}", *cells, "", ""]
    halves = [0.5 * scale * (row["high"] - row["low"]) for scale, row in zip(scales, told, strict=True)]
    inside = sum(row["low"] <= row["true"] <= row["high"] for row in told)
    return [word, f"{len(told)} of {len(rows)}", *cells, f"{quantile(halves, 0.5):.2g} {unit}", f"{inside} of {len(told)}"]


STUDY = Study(
    options={"rigs": 64, "seed": 773000, "duration": 5.0, "sensors": "encoders"},
    tasks=_tasks,
    keep=_kept,
    units={"misfit": "of the log's noise", "value": "the parameter's"},
    show=_shown,
    partial=True,
    words={"duration": "s of each log", "rigs": "randomised benches", "sensors": "of the benches"},
)
register(study="recovery-rail", about="how well identification finds benches of one cylinder")(STUDY)
