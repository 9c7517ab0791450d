"""What controllers make of frictions that they do not expect: rest, stiffness, circles and air, over the whole sweep.

The sweep is that of ``birthsim_env.parts.drawn.frictions``. Rigs and scenarios are drawn; a seed has the same rig under every
friction. All controllers believe the default friction, but for those that are told each rig, as after an identification: these
know its levels, bristles and Stribeck speed, but not its law. With an acceleration sensor the controller weighs laws by itself;
all others follow LuGre.
"""

from typing import Any

import numpy as np

from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.work.tasks import Task
from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import names, register
from lab.engine import information
from lab.engine.information import Row
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import Cell, Head, markdown
from lab.engine.worlds import worlds
from lab.studies.comparison.grid import Conditions, cell_task, gather, settings_of
from lab.studies.comparison.privileged import TOLD

SENSORS = "honest"


ROWS = (
    Row("admittance-adaptive"),
    Row("admittance-sensorless", information.TOLD, "examples/acceleration_sensor_rig.toml"),
    Row("disturbance-observer"),
    Row("time-delay"),
    Row("pid"),
    Row("backstepping"),
)
"""The best controllers with a force sensor and without one, rivals, and the paper's law."""

METRICS = {
    "hunting": ("BirthSIM/Probe-v3", "hunting, mm"),
    "stiffness_error": ("BirthSIM/Probe-v3", "stiffness error, %"),
    "settled_rms": ("BirthSIM/Circle-v2", "settled error of circles, mm"),
    "air": ("BirthSIM/Probe-v3", "air at rest and under a push, l/min"),
}
"""What is kept, median and 90th percentile over the worlds: environment, and head of its column."""

ENVIRONMENTS = tuple(dict.fromkeys(environment for environment, _ in METRICS.values()))

ASSUMED = "lugre"
"""The friction that controllers expect."""


def _tasks(options: Options) -> dict[Any, Task]:
    found: dict[Any, Task] = {}
    for friction in options.friction:
        for row in ROWS:
            rig = with_friction(load_parameters(ROOT / row.file if row.file else None), friction)
            (settings,) = settings_of(f"{TOLD * (row.rig == information.TOLD)}{row.controller}", rig).values()
            for environment in ENVIRONMENTS:
                task = cell_task(settings, Conditions(environment, SENSORS, "randomised"), options.episodes, options.seed)
                stem = f"{friction}/{row.controller}-{environment.rpartition('/')[2]}"
                found[friction, row, environment] = Task(stem, task.work, task.settings)
    return found


def _kept(options: Options, found: Found) -> Any:
    figures = []
    for friction in options.friction:
        for row in ROWS:
            one: dict[str, Any] = {"friction": friction, **row._asdict()}
            for metric, (environment, _) in METRICS.items():
                where = Conditions(environment, SENSORS, "randomised")
                cell = gather({(row.controller, where): found[friction, row, environment]})[row.controller, where]
                values = penalize_lost(np.abs(cell.metrics[metric]), cell.lost, applies=True)
                one[metric] = [quantile(values, part) for part in (0.5, 0.9)]
            one["lost"] = sum(sum(found[friction, row, environment]["lost"]) for environment in ENVIRONMENTS)
            figures.append(one)
    return jsonable(figures)


PARTS = ("median", "90 %")
FRICTIONS = {"as expected": PARTS, "under the worst friction": (*PARTS, "which")}
"""Frictions of the summary, and what stands of each."""


def _size(value: float | str) -> float:
    return np.inf if isinstance(value, str) else value


def _shown(content: Content) -> dict[str, str]:
    settings, found = content["settings"], dict[Row, dict[str, Any]]()
    for one in content["figures"]:
        found.setdefault(Row(one["controller"], one["rig"], one["file"]), {})[one["friction"]] = one
    heads = [head for _, head in METRICS.values()]
    whole: list[list[Cell | Head]] = [
        [
            *("controller", *information.COLUMNS),
            *(Head(head.replace(", ", f" {of}, "), parts) for head in heads for of, parts in FRICTIONS.items()),
            "lost",
        ]
    ]
    for row, by in found.items():
        figures: list[Cell] = []
        for metric in METRICS:
            worst = max(by, key=lambda friction: _size(by[friction][metric][1]))
            figures += [by[ASSUMED][metric] if ASSUMED in by else "", [*by[worst][metric], f"`{worst}`"]]
        lost = sum(one["lost"] for one in by.values())
        whole.append([row.name, *row.facts(SENSORS), *figures, str(lost)])
    tables = []
    for metric, (_, head) in METRICS.items():
        rows: list[list[Cell | Head]] = [["friction", *(Head(row.name, PARTS) for row in found)]]
        for friction in settings["friction"]:
            rows.append([f"`{friction}`", *(by[friction][metric] for by in found.values())])
        tables.append(f"{head[0].upper()}{head[1:]}:\n\n{markdown(rows)}")
    said = (
        f"{worlds(settings['seed'], settings['episodes'])}, {SENSORS} sensors, rigs drawn. 90 % is the 90th percentile; as "
        f"expected is `{ASSUMED}`, worst the friction with the largest 90th percentile."
    )
    summary = f"{said} {information.LEGEND}\n\n{markdown(whole)}\n"
    return {"friction-laws.md": summary, "friction-laws-each.md": "\n\n".join(tables) + "\n"}


STUDY = Study(
    {
        "friction": tuple(name for name in names("friction") if name != "drawn-smooth"),
        "episodes": 48,
        "seed": 61_000_000,
    },
    _tasks,
    _kept,
    {"hunting": "mm", "stiffness_error": "%", "settled_rms": "mm", "air": "l/min"},
    _shown,
    words={"friction": "names of the sweep", "episodes": "of each scenario and friction"},
)
register(study="friction-laws", about="what controllers make of frictions that they do not expect")(STUDY)
