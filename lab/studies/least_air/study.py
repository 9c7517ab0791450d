"""How much air the schedule of least air saves, and what it does to the errors."""

from itertools import product
from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.parts.scenarios import environment_id, find_scenario
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import worlds
from lab.studies.least_air.schedule import least_air

PUSHES = {"circle": [(30.0, 0.0), (-30.0, 0.0), (0.0, 30.0), (0.0, -30.0)], "descent": [(80.0, 0.0)]}
"""N: the strongest pushes of the scenarios' hands."""

CONTROLLERS, SENSORS = ("backstepping", "admittance-backstepping"), ("ideal", "lab")

UNITS = {"air": "l/min", "saved": "%", "error": "mm"}


def measure(scenario: str, controller: str, sensors: str, episodes: int, seed: int) -> Result:
    """With the scenario's own pneumatic stiffness and with least air, on the same randomised rigs: the median of ``air``; the
    median of what is ``saved``, and 5 and 95 % of the episodes; median and 95 % of the settled ``error``; ``lost`` episodes."""
    rig = Parameters()
    reference, _, own = find_scenario(scenario).nominal()
    least = least_air(reference, own, find_scenario(scenario).duration, rig, PUSHES[scenario])
    both = [
        evaluate(
            environment_id(scenario),
            make_controller(controller, rig),
            controller,
            episodes,
            seed,
            False,
            sensors=sensors,
            randomize="plant",
            stiffness=stiffness,
        )
        for stiffness in (own, least)
    ]
    air = [np.array(one.metrics["air"]) for one in both]
    return {
        "air": [float(np.median(one)) for one in air],
        "saved": np.quantile(100 * (1 - air[1] / air[0]), (0.5, 0.05, 0.95)).tolist(),
        "error": [np.quantile(one.metrics["settled_rms"], (0.5, 0.95)).tolist() for one in both],
        "lost": [int(sum(one.lost)) for one in both],
    }


def _tasks(options: Options) -> dict[Any, Task]:
    own = {"episodes": options.episodes, "seed": options.seed}
    return {
        key: Task("-".join(key), measure, dict(zip(("scenario", "controller", "sensors"), key, strict=True)) | own)
        for key in product(options.scenario, CONTROLLERS, SENSORS)
    }


def _kept(options: Options, found: Found) -> Any:
    return [{"scenario": key[0], "controller": key[1], "sensors": key[2], **result} for key, result in found.items()]


def _shown(content: Content) -> dict[str, str]:
    pair = ("its own", "least air")
    heads = [Head("air, l/min", pair), Head("saved, %", ("median", "5 %", "95 %"))]
    heads += (Head("settled error, mm, its own", SPREAD), Head("settled error, mm, least air", SPREAD), Head("lost", pair))
    rows: list[list[Cell | Head]] = [["scenario", "controller", *information.COLUMNS, "sensors", *heads]]
    for row in content["figures"]:
        rows.append(
            [
                row["scenario"],
                f"`{row['controller']}`",
                *information.informed(row["controller"], row["sensors"]),
                row["sensors"],
                row["air"],
                row["saved"],
                *row["error"],
                list(map(str, row["lost"])),
            ]
        )
    said = worlds(content["settings"]["seed"], content["settings"]["episodes"])
    return {"air.md": f"{said}, randomised rigs on the scenario as described.\n\n{markdown(rows)}\n"}


STUDY = Study(
    {"scenario": tuple(PUSHES), "episodes": 64, "seed": 96000},
    _tasks,
    _kept,
    UNITS,
    _shown,
    allowed={"scenario": tuple(PUSHES)},
)
register(study="air", about="how much air the schedule of least air saves")(STUDY)
