"""What the errors of honest sensors leave to the best controller on randomised rigs."""

from typing import Any

import numpy as np

from baselines.bench.statistics import quantile
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Options, Study, as_found
from lab.engine.tables import SPREAD_AND_WORST, Cell, Head, markdown
from lab.studies.comparison.grid import as_described
from lab.studies.honest.sensor_floor import probe_floor

UNITS = {"stiffness_error": "%", "held_error": "mm"}
FRACTIONS = {"median": 0.5, "q95": 0.95, "worst": 1.0}


def _tasks(options: Options) -> dict[Any, Task]:
    believed = load_parameters(options.parameters or None)
    rigs = {"honest": as_described(believed), "honest, drawn": believed}
    own = {"episodes": options.episodes, "seed": options.seed}
    return {kind: Task(kind.replace(", ", "-"), floor, {"rig": rig.to_dict(), **own}) for kind, rig in rigs.items()}


def floor(rig: dict[str, Any], episodes: int, seed: int) -> Result:
    """Of ``probe_floor`` each metric's sizes: median, 95 % and worst."""
    sizes = {name: np.abs(values) for name, values in probe_floor(Parameters.from_dict(rig), episodes, seed).items()}
    return {name: {key: quantile(sizes[name], fraction) for key, fraction in FRACTIONS.items()} for name in UNITS}


def _shown(content: Content) -> dict[str, str]:
    heads = (Head("stiffness error, %", SPREAD_AND_WORST), Head("error while held, mm", SPREAD_AND_WORST))
    rows: list[list[Cell | Head]] = [["sensors", *heads]]
    for kind, found in content["figures"].items():
        rows.append([kind.replace("drawn", "randomised"), *([found[name][key] for key in FRACTIONS] for name in UNITS)])
    return {"floor.md": markdown(rows) + "\n"}


STUDY = Study(
    {"episodes": 128, "seed": 70000, "parameters": ""},
    _tasks,
    as_found,
    UNITS,
    _shown,
)
register(study="floor", about="what errors of honest sensors leave to controllers")(STUDY)
