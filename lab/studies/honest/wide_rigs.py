"""Controllers on rigs far from the default one, which they believe or know to within 5 %: light and heavy, other friction,
supply and bores at once."""

from itertools import count, product
from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import controller_settings
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.assembly import Arguments
from birthsim_env.parts.drawn.randomization import draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.strength import carried
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import cells, markdown
from lab.engine.worlds import worlds
from lab.studies.sensorless.rigs import OFF, around

RANGES = {
    "mechanics.mass": (1.0, 10.0), "air.supply_pressure": (5e5, 9e5),
    "cylinder1.coulomb_friction": (4.0, 40.0), "cylinder2.coulomb_friction": (5.0, 45.0),
    "cylinder1.piston_diameter": (0.020, 0.032), "cylinder2.piston_diameter": (0.020, 0.032),
}  # fmt: skip
"""SI units; assumed: 0.3 to 3 times the default's mass and friction, and air and bores that are for sale."""

STRENGTH = 0.9
"""Worlds that ask for a larger fraction of their rig's strength are left out; assumed."""

TARGETS = np.array([[0.4, 0.6, 0.5, 0.5], [0.0, 0.0, -0.1, 0.1]])
"""m (2, places): where the widest circles reach to; known rigs carry their own weight there."""

KNOWS = "admittance-adaptive"
"""The controller that is also told its rig."""

LANES = {False: 256, True: 16}
"""Worlds of a piece, by whether the rig is known: those of one piece share what the controller believes."""

METRICS = {"circle": ("settled_rms", 5.0), "probe": ("hunting", 2.0)}
"""Scenario -> its metric, mm, and what is too much of it; assumed."""


def known(rig: Parameters, seed: int) -> Parameters:
    """A rig drawn from ``RANGES`` that can carry its own weight at the scenarios' targets."""
    drawn = (draw_parameters(rig, RANGES, stream(seed, again, "parameters")) for again in count())
    return next(one for one in drawn if carried(TARGETS, one).max() <= 1.0)


def measure(
    scenario: str, controller: str, source: str, rig: dict[str, Any], ranges: dict[str, Any], episodes: int, seed: int
) -> Result:
    """Of worlds within their rigs' strength: the metric of ``METRICS``, mm, or "lost", and stiffness errors, %.

    The controller believes ``rig``; the true ones are drawn from ``ranges``.
    """
    believed = Parameters.from_dict(rig)
    law = make_controller(controller, believed)
    drawn = {name: (low, high) for name, (low, high) in ranges.items()}
    worlds: Arguments = {"randomize": drawn, "sensors": "honest", "parameters": believed}
    found = evaluate(environment_id(scenario), law, controller, episodes, seed, progress=False, **worlds)
    within = np.asarray(found.required_strength_ratio) <= STRENGTH
    values = {name: np.asarray(values) for name, values in found.metrics.items()}
    values["hunting"] = np.fmax(values["hunting_x"], values["hunting_y"])
    named = {"error": values[METRICS[scenario][0]], "stiffness_error": np.abs(values["stiffness_error"])}
    return jsonable({name: penalize_lost(each, found.lost)[within].tolist() for name, each in named.items()})  # type: ignore[no-any-return]


def _tasks(options: Options) -> dict[Any, Task]:
    found = {}
    for scenario, (name, told) in product(METRICS, _rows(options)):
        for first in range(options.seed, options.seed + options.episodes, LANES[told]):
            rig, ranges = Parameters(), RANGES
            if told:
                rig = known(rig, first)
                ranges = {figure: around(rig, figure, OFF) for figure in RANGES}
            worlds = {"ranges": ranges, "episodes": min(LANES[told], options.seed + options.episodes - first), "seed": first}
            found[scenario, name, told, first] = Task(
                f"{scenario}-{name}/{'known' if told else 'default'}-{first}",
                measure,
                {"scenario": scenario, **controller_settings(name, rig), **worlds},
            )
    return found


def _rows(options: Options) -> list[tuple[str, bool]]:
    """The table's rows: a controller, and whether it knows its rig."""
    return [(name, False) for name in options.controller] + [(KNOWS, True)]


def _figures(values: list[Any], most: float) -> dict[str, Any]:
    sizes = np.array([np.inf if value == "lost" else value for value in values], dtype=np.float64)
    shares = {name: quantile(sizes, share) for name, share in (("median", 0.5), ("q95", 0.95), ("worst", 1.0))}
    return {**shares, "beyond": int((sizes > most).sum()), "of": len(sizes)}


def _kept(options: Options, found: Found) -> Any:
    rows = []
    for name, told in _rows(options):
        of = {one: [own for key, own in found.items() if key[:3] == (one, name, told)] for one in METRICS}
        sizes = {one: [value for own in of[one] for value in own["error"]] for one in METRICS}
        stiffness = [value for own in of["probe"] for value in own["stiffness_error"]]
        figures = {one: _figures(sizes[one], most) for one, (_, most) in METRICS.items()}
        rows.append({"controller": name, "known": told, **figures, "stiffness_error": _figures(stiffness, np.inf)})
    return jsonable(rows)


def _shown(content: Content) -> dict[str, str]:
    titles = [f"{scenario}: {metric.split('_')[0]}, mm; beyond {most:g} mm" for scenario, (metric, most) in METRICS.items()]
    rows = [["controller", *information.COLUMNS, *titles, "stiffness error, %"]]
    for own in content["figures"]:
        shown = {key: cells([own[key][share] for share in ("median", "q95", "worst")]) for key in (*METRICS, "stiffness_error")}
        beyond = [f"{shown[key]}; {own[key]['beyond']} of {own[key]['of']}" for key in METRICS]
        rig = f"{information.TOLD} to {100 * OFF:g} %" if own["known"] else information.DEFAULT
        facts = information.informed(own["controller"], "honest", rig=rig)
        rows.append([f"`{own['controller']}`", *facts, *beyond, shown["stiffness_error"]])
    drawn = worlds(content["settings"]["seed"], content["settings"]["episodes"])
    said = f"{drawn}, of which those count that ask for at most {100 * STRENGTH:g} % of the rig's strength."
    table = markdown(rows, rows[0][4:], alike=[row[1] for row in rows[1:]])
    return {"wide_rigs.md": f"{said}\n\n{table}\n"}


STUDY = Study(
    {"controller": ("admittance-backstepping", "admittance-adaptive"), "episodes": 256, "seed": 948000},
    _tasks,
    _kept,
    {"circle": "mm", "probe": "mm", "stiffness_error": "%"},
    _shown,
    words={"controller": "registered names, with options"},
)
register(study="wide-rigs", about="controllers on rigs of 1 to 10 kg that they do not know")(STUDY)
