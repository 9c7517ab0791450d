"""Controllers on rigs far from the default one, which they believe, find or are told: mass, friction, supply, bores, lag and
dead volume at once, within the ranges that the filter of rigs expects and beyond them. All rows have the same worlds."""

from itertools import product
from typing import Any, cast

import numpy as np

from baselines.admittance.controller import AdmittanceController
from baselines.bench.evaluation import evaluate
from baselines.bench.feasibility import FEASIBLE
from baselines.bench.pieces import controller_settings
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.estimation.rig_filter import TOLD
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.assembly import Arguments
from birthsim_env.parts.drawn.randomization import Ranges
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD_AND_WORST, Cell, Head, markdown
from lab.engine.worlds import worlds
from lab.studies.comparison.privileged import drawn_rigs

BEYOND = 1.2
"""How far the wider ranges reach beyond both ends of those that the filter expects; assumed."""

LEAST_DEAD_VOLUME = 1.17e-5
"""m3: what a piston of the wider ranges needs at least, 10 mm of the largest."""

RANGES: dict[str, Ranges] = {
    "expected": TOLD,
    "beyond": {name: (low / BEYOND, high * BEYOND) for name, (low, high) in TOLD.items()}
    | {"chambers.dead_volume": (LEAST_DEAD_VOLUME, TOLD["chambers.dead_volume"][1] * BEYOND)},
}
"""What rigs are drawn from: as the filter expects, and wider."""

KNOWS = "admittance-adaptive[own_beliefs=true]"
"""The controller each lane of which is told its rig besides."""

METRICS = {
    "circle": ("circle", "settled_rms", "settled error", 5.0),
    "probe": ("probe", "hunting", "hunting", 2.0),
    "probe-error": ("probe", "settled_rms", "settled error", 5.0),
}
"""Name -> scenario, metric, mm, as it is called, and what is too much of it; assumed."""

SCENARIOS = tuple(dict.fromkeys(scenario for scenario, *_ in METRICS.values()))


def measure(
    scenario: str, controller: str, source: str, rig: dict[str, Any], told: bool, ranges: str, episodes: int, seed: int
) -> Result:
    """Of worlds within their rigs' strength: metrics of ``METRICS``, mm, or "lost", and stiffness errors, %.

    Rigs are drawn from ``RANGES[ranges]``; the controller believes ``rig``, or is ``told`` each."""
    believed = Parameters.from_dict(rig)
    law = make_controller(controller, believed)
    if told:
        cast(AdmittanceController, law).believe(drawn_rigs(believed, RANGES[ranges], range(seed, seed + episodes)))
    drawn: Arguments = {"randomize": RANGES[ranges], "sensors": "honest", "parameters": believed}
    found = evaluate(environment_id(scenario), law, controller, episodes, seed, progress=False, **drawn)
    within = np.asarray(found.required_strength_ratio) <= FEASIBLE
    values = {name: np.asarray(values) for name, values in found.metrics.items()}
    values["hunting"] = np.fmax(values["hunting_x"], values["hunting_y"])
    named = {metric: values[metric] for of, metric, *_ in METRICS.values() if of == scenario}
    named["stiffness_error"] = np.abs(values["stiffness_error"])
    return jsonable({name: penalize_lost(each, found.lost)[within].tolist() for name, each in named.items()})  # type: ignore[no-any-return]


def _tasks(options: Options) -> dict[Any, Task]:
    worlds = {"episodes": options.episodes, "seed": options.seed}
    return {
        (ranges, scenario, name, told): Task(
            f"{ranges}-{scenario}-{name}/{'told' if told else 'default'}",
            measure,
            {"scenario": scenario, **controller_settings(name, Parameters()), "told": told, "ranges": ranges, **worlds},
        )
        for ranges, scenario, (name, told) in product(RANGES, SCENARIOS, _rows(options))
    }


def _rows(options: Options) -> list[tuple[str, bool]]:
    """The table's rows: a controller, and whether it is told its rig."""
    return [(name, False) for name in options.controller] + [(KNOWS, True)]


def _figures(values: list[Any], most: float) -> dict[str, Any]:
    sizes = np.array([np.inf if value == "lost" else value for value in values], dtype=np.float64)
    shares = {name: quantile(sizes, share) for name, share in (("median", 0.5), ("q95", 0.95), ("worst", 1.0))}
    return {**shares, "beyond": int((sizes > most).sum()), "of": len(sizes)}


def _kept(options: Options, found: Found) -> Any:
    kept: dict[str, list[dict[str, Any]]] = {}
    for ranges, (name, told) in product(RANGES, _rows(options)):
        of = {one: found[ranges, one, name, told] for one in SCENARIOS}
        figures = {one: _figures(of[scenario][metric], most) for one, (scenario, metric, _, most) in METRICS.items()}
        stiffness = _figures(of["probe"]["stiffness_error"], np.inf)
        kept.setdefault(ranges, []).append({"controller": name, "told": told, **figures, "stiffness_error": stiffness})
    return jsonable(kept)


def _table(rows_of: list[dict[str, Any]]) -> str:
    titles = [
        Head(f"{scenario}: {called}, mm", (*SPREAD_AND_WORST, f"beyond {most:g} mm"))
        for scenario, _, called, most in METRICS.values()
    ]
    titles.append(Head("stiffness error, %", SPREAD_AND_WORST))
    rows: list[list[Cell | Head]] = [["controller", *information.COLUMNS, *titles]]
    for own in rows_of:
        shown = {key: [own[key][share] for share in ("median", "q95", "worst")] for key in (*METRICS, "stiffness_error")}
        beyond = [[*shown[key], f"{own[key]['beyond']} of {own[key]['of']}"] for key in METRICS]
        rig = information.TOLD if own["told"] else information.DEFAULT
        facts = information.informed(own["controller"], "honest", rig=rig)
        rows.append([f"`{own['controller']}`", *facts, *beyond, shown["stiffness_error"]])
    return markdown(rows, titles, alike=[str(row[1]) for row in rows[1:]])


def _shown(content: Content) -> dict[str, str]:
    drawn = worlds(content["settings"]["seed"], content["settings"]["episodes"])
    said = f"{drawn}, of which those count that ask for at most {100 * FEASIBLE:g} % of the rig's strength."
    inside, outside = (_table(content["figures"][ranges]) for ranges in RANGES)
    wider = f"Ranges that reach beyond those by {100 * (BEYOND - 1):.0f} % at both ends:"
    return {"wide_rigs.md": f"{said}\n\n{inside}\n\n{wider}\n\n{outside}\n"}


CONTROLLERS = (
    "backstepping",
    "admittance-backstepping",
    "admittance-adaptive",
    "admittance-adaptive[finds_rig=true]",
    "admittance-adaptive[reader=wide]",
)

STUDY = Study(
    {"controller": CONTROLLERS, "episodes": 256, "seed": 993000},
    _tasks,
    _kept,
    {**dict.fromkeys(METRICS, "mm"), "stiffness_error": "%"},
    _shown,
    words={"controller": "registered names, with options"},
)
register(study="wide-rigs", about="controllers on rigs of 1 to 10 kg that they do not know")(STUDY)
