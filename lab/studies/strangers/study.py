"""Identification and controllers on rigs that the package's model lacks."""

from typing import Any

import numpy as np

from baselines.bench.statistics import penalize_lost
from baselines.work.tasks import Task
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import Cell, Head, digits, markdown
from lab.studies.strangers.tasks import STRANGERS, stranger_tasks

BELIEFS = ("owner", "identified")


def _tasks(options: Options) -> dict[Any, Task]:
    return {**stranger_tasks(options.rigs, options.seed, options.duration, list(options.controller))}


def _kept(options: Options, found: Found) -> Any:
    """Stranger -> what came of each of its rigs."""
    return {name: [result for (one, _), result in found.items() if one == name] for name in STRANGERS}


def _shown(content: Content) -> dict[str, str]:
    settings, figures = content["settings"], content["figures"]
    head = (
        f"{settings['rigs']} randomised rigs each, seeds from {settings['seed']}, logs of {settings['duration']:g} s. Cells "
        "have the largest of these rigs."
    )
    parts = [head, markdown(_identified(figures))]
    for one in settings["controller"]:
        parts += [f"`{one}` with `honest` sensors, as told by its owner and as identified:", markdown(_driven(figures, one))]
    return {"strangers.md": "\n\n".join(parts) + "\n"}


def _identified(figures: dict[str, Any]) -> list[list[str]]:
    rows = [["the rig has", "warned", "residuals over noise: pressures", "positions", "error of the mass, %", "of friction, %"]]
    for name, found in figures.items():
        misfits = np.max([one["misfit"] for one in found], axis=0)
        mass = max(abs(one["mass"]) for one in found)
        friction = max(abs(error) for one in found for error in one["friction"])
        warned = f"{sum(one['warned'] for one in found)} of {len(found)}"
        rows.append([name, warned, *map(digits, misfits), digits(100 * mass), digits(100 * friction)])
    return rows


def _driven(figures: dict[str, Any], controller: str) -> list[list[Cell | Head]]:
    quantities = ("circle, mm", "stiffness error, %", "hunting under a push, mm", "lost")
    rows: list[list[Cell | Head]] = [["the rig has", *(Head(quantity, ("as told", "identified")) for quantity in quantities)]]
    for name, found in figures.items():
        cells = [[one["controllers"][controller][belief] for one in found] for belief in BELIEFS]
        row: list[Cell | Head] = [name]
        for key, scale in (("error", 1e3), ("stiffness", 100.0), ("hunting", 1e3)):
            row.append([scale * _worst(each, key) for each in cells])
        rows.append([*row, [str(sum(one["lost"] for one in each)) for each in cells]])
    return rows


def _worst(results: list[dict[str, Any]], key: str) -> float:
    values = np.array([abs(one[key]) for one in results])
    return float(penalize_lost(values, np.array([one["lost"] for one in results]), applies=True).max())


STUDY = Study(
    {"rigs": 2, "seed": 93000, "duration": 12.0, "controller": ("admittance-adaptive", "admittance-sensorless")},
    _tasks,
    _kept,
    {"error": "m", "hunting": "m", "stiffness": "1", "mass": "1", "friction": "1"},
    _shown,
    words={"duration": "s of each log", "rigs": "randomised, of each kind"},
)
"""What identification and controllers make of rigs that the model lacks."""
register(study="strangers", about="identification and controllers on rigs that the model lacks")(STUDY)
