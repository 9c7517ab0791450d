"""A rig without a force sensor, with and without an acceleration sensor, beside a rig that has a force sensor."""

from collections.abc import Iterable
from itertools import product
from typing import Any

import numpy as np

from baselines.bench.pieces import controller_settings
from baselines.bench.statistics import jsonable, quantile
from baselines.work.tasks import Task
from birthsim_env.parts.scenarios import studied_scenarios
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import worlds
from lab.studies.sensorless.measures import measure
from lab.studies.sensorless.rigs import PLANTS, believed

RIGS = {
    "acceleration, no force": ("admittance-sensorless", "examples/acceleration_sensor_rig.toml"),
    "neither": ("admittance-sensorless", None),
    "neither, friction identified": ("admittance[force_sensor=false,identified=true]", None),
    "force": ("admittance-adaptive", None),
}
"""Sensors besides positions and pressures -> the controller that makes the best of them, and its rig."""

TOLD = {"nominal": information.TOLD, "randomised": information.DEFAULT}
"""What each of ``PLANTS`` makes of the rig that controllers believe."""

LANES = 64
"""Worlds of a piece."""

COLUMNS = {
    "stiffness_error": "stiffness error, %", "hunting": "hunting, mm", "clamped_mm": "held by a clamp, mm",
    "clamped_N": "held by a clamp, N",
    "noticed": "JND at 1 Hz", "overshoot": "overshoot after 190 and 241 N, mm",
    "air": "air of a push, l/min", "clamped_air": "air of a clamped head, l/min", "turns": "valve turns, 1/s",
}  # fmt: skip


def _tasks(options: Options) -> dict[Any, Task]:
    found = {}
    for (rig, (controller, file)), plant in product(RIGS.items(), options.plant):
        parameters = load_parameters(ROOT / file if file else None)
        own, last = controller_settings(controller, believed(parameters, plant)), options.seed + options.episodes
        for first in range(options.seed, last, LANES):
            lanes = min(LANES, last - first)
            more = {"sensors": "honest", "force_sensor": rig == "force", "seed": first, "lanes": lanes}
            found[rig, plant, first] = Task(f"{stem_of(rig)}/{plant}-{first}", measure, {**own, **more})
    return found


def stem_of(rig: str) -> str:
    """One of ``RIGS`` in a file's name."""
    return rig.replace(", ", "-").replace(" ", "-")


def kept(plants: Iterable[str], found: Found) -> Any:
    """A row for each of ``RIGS`` and each plant: medians, 95th percentiles and the worst."""
    rows = []
    for rig, plant in product(RIGS, plants):
        pieces = [result for key, result in found.items() if key[:2] == (rig, plant)]
        values = {name: np.concatenate([piece[name] for piece in pieces]) for name in (*COLUMNS, *studied_scenarios(), "lost")}
        figures = {
            name: [quantile(values[name], share) for share in (0.5, 0.95, 1.0)] for name in (*COLUMNS, *studied_scenarios())
        }
        lost = int(values["lost"].sum())
        rows.append({"rig": rig, "plant": plant, "lost": lost, "of": len(values["lost"]), "figures": figures})
    return jsonable(rows)


def tables(figures: Any, settings: dict[str, Any]) -> str:
    """What a hand feels, and errors by scenario, in the worlds of a result's ``settings``."""
    found = [f"{worlds(settings['seed'], settings['episodes'])}, of every scenario. {information.LEGEND}"]
    for names, titles in (
        (COLUMNS, list(COLUMNS.values())),
        (studied_scenarios(), [f"{name}: settled error, mm" for name in studied_scenarios()]),
    ):
        heads = [Head(title, SPREAD) for title in titles]
        rows: list[list[Cell | Head]] = [["force or acceleration sensor", "controller", *information.COLUMNS, *heads, "lost"]]
        for row in figures:
            shown = [row["figures"][name][:2] for name in names]
            controller, file = RIGS[row["rig"]]
            facts = information.informed(controller, "honest", rig=TOLD.get(row["plant"], row["plant"]), parameters=file or "")
            rows.append([row["rig"], f"`{controller}`", *facts, *shown, f"{row['lost']} of {row['of']}"])
        found.append(markdown(rows))
    return "\n\n".join(found) + "\n"


def _kept(options: Options, found: Found) -> Any:
    return kept(options.plant, found)


def _shown(content: Content) -> dict[str, str]:
    return {"sensorless.md": tables(content["figures"], content["settings"])}


STUDY = Study(
    {"plant": PLANTS, "episodes": 128, "seed": 330000},
    _tasks,
    _kept,
    {
        "stiffness_error": "%",
        "hunting": "mm",
        "clamped_mm": "mm",
        "clamped_N": "held by a clamp, N",
        "overshoot": "mm",
        **dict.fromkeys(studied_scenarios(), "mm"),
        "air": "l/min",
        "clamped_air": "l/min",
        "turns": "1/s",
    },
    _shown,
    allowed={"plant": PLANTS},
    words={"plant": "what the controller knows of the rig"},
)
register(study="sensorless", about="what a hand feels without a force sensor")(STUDY)
