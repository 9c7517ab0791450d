"""Controllers that believe the default rig, on rigs far from it: light and heavy, other friction, supply and bores at once."""

from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import controller_settings
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.registry import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from studies.results import Content
from studies.study import Found, Options, Study
from studies.tables import cells, markdown

RANGES = {
    "mechanics.mass": (1.0, 10.0), "air.supply_pressure": (5e5, 9e5),
    "cylinder1.coulomb_friction": (4.0, 40.0), "cylinder2.coulomb_friction": (5.0, 45.0),
    "cylinder1.piston_diameter": (0.020, 0.032), "cylinder2.piston_diameter": (0.020, 0.032),
}  # fmt: skip
"""SI units; assumed: 0.3 to 3 times the default's mass and friction, and air and bores that are for sale."""

STRENGTH = 0.9
"""Worlds that ask for a larger fraction of their rig's strength are left out; assumed."""

METRICS = {"circle": ("settled_rms", 5.0), "probe": ("hunting", 2.0)}
"""Scenario -> its metric, mm, and what is too much of it; assumed."""


def measure(scenario: str, controller: str, source: str, rig: dict[str, Any], episodes: int, seed: int) -> Result:
    """Of worlds within their rigs' strength: the metric of ``METRICS``, mm, or "lost", and stiffness errors, %."""
    believed = Parameters.from_dict(rig)
    law = make_controller(controller, believed)
    worlds = {"randomize": RANGES, "sensors": "honest", "parameters": believed}
    found = evaluate(environment_id(scenario), law, controller, episodes, seed, progress=False, **worlds)
    within = np.asarray(found.required_strength_ratio) <= STRENGTH
    values = {name: np.asarray(values) for name, values in found.metrics.items()}
    values["hunting"] = np.fmax(values["hunting_x"], values["hunting_y"])
    named = {"error": values[METRICS[scenario][0]], "stiffness_error": np.abs(values["stiffness_error"])}
    return jsonable({name: penalize_lost(each, found.lost)[within].tolist() for name, each in named.items()})  # type: ignore[no-any-return]


def _tasks(options: Options) -> dict[Any, Task]:
    rig = Parameters()
    return {
        (scenario, name): Task(
            f"{scenario}-{name}", name, measure,
            {"scenario": scenario, **controller_settings(name, rig), "episodes": options.episodes, "seed": options.seed},
        )
        for scenario in METRICS for name in options.controller
    }  # fmt: skip


def _figures(values: list[Any], most: float) -> dict[str, Any]:
    sizes = np.array([np.inf if value == "lost" else value for value in values], dtype=np.float64)
    shares = {name: quantile(sizes, share) for name, share in (("median", 0.5), ("q95", 0.95), ("worst", 1.0))}
    return {**shares, "beyond": int((sizes > most).sum()), "of": len(sizes)}


def _kept(options: Options, found: Found) -> Any:
    return jsonable({
        name: {
            **{scenario: _figures(found[scenario, name]["error"], most) for scenario, (_, most) in METRICS.items()},
            "stiffness_error": _figures(found["probe", name]["stiffness_error"], np.inf),
        }
        for name in options.controller
    })  # fmt: skip


def _shown(content: Content) -> dict[str, str]:
    titles = [f"{scenario}: {metric.split('_')[0]}, mm; beyond {most:g} mm" for scenario, (metric, most) in METRICS.items()]
    rows = [["controller", *titles, "stiffness error, %"]]
    for name, figures in content["figures"].items():
        shown = {key: cells([own[share] for share in ("median", "q95", "worst")]) for key, own in figures.items()}
        beyond = [f"{shown[key]}; {figures[key]['beyond']} of {figures[key]['of']}" for key in METRICS]
        rows.append([f"`{name}`", *beyond, shown["stiffness_error"]])
    return {"wide_rigs.md": markdown(rows) + "\n"}


STUDY = Study(
    (__name__,), {"controller": ("admittance-backstepping", "admittance-adaptive"), "episodes": 256, "seed": 948000},
    _tasks, _kept, {"circle": "mm", "probe": "mm", "stiffness_error": "%"}, _shown,
    words={"controller": "registered names, with options"},
)  # fmt: skip
