"""What the rig as it is measured does to controllers: the assumptions that were exchanged, one by one and all together.

Each rig is what its controllers believe, and its worlds are drawn about it: ``ASSUMED`` has valves whose flow is proportional
to their opening, friction that does not depend on pressure and bristles of one stiffness, and ``EXCHANGED`` puts in their place
what others measured (docs/validation.md). All together are the default rig. Worlds, controllers and integrator are the same
throughout, so that nothing but the rig differs.
"""

import dataclasses
import itertools
from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import SEED, worlds

LEVELS = {"cylinder1.coulomb_friction": 12.0, "cylinder2.coulomb_friction": 15.0}
"""N: friction that does not depend on pressure, as the default rig has it at mid pressures."""

ASSUMED: dict[str, dict[str, tuple[float, float, float]]] = {
    "valves": {name: (value, value, value) for name, value in LINEAR.changes().items()},
    "seals": {
        **{name: (value, 6.0, 25.0) for name, value in LEVELS.items()},
        **{f"cylinder{k}.pressure_friction": (0.0, 0.0, 0.0) for k in (1, 2)},
    },
    "bristles": {"friction.bristle_stiffness": (5e4, 5e4, 5e4)},
}
"""What was assumed of a part of the rig: parameter -> (value, lowest and highest drawn)."""

EXCHANGED: dict[str, tuple[str, ...]] = {"assumed": (), **{part: (part,) for part in ASSUMED}, "measured": tuple(ASSUMED)}
"""Names of the rigs, and which parts have what was measured."""

WHOLE = ("assumed", "measured")
"""The rigs of all controllers' table."""

WORDS = {"assumed": "nothing", "measured": "all"}
"""Names of the rigs in tables, where they are no parts."""

COLUMNS = {
    "settled": ("BirthSIM/Circle-v2", ("settled_rms",), "settled error of circles, mm"),
    "stiffness": ("BirthSIM/Probe-v3", ("stiffness_error",), "error of stiffness, %"),
    "hunting": ("BirthSIM/Probe-v3", ("hunting_x", "hunting_y"), "hunting, mm"),
}
"""What is kept, median and 95th percentile over the worlds: environment, metrics of which the largest counts, head."""


def rig_of(exchanged: tuple[str, ...]) -> Parameters:
    """A rig in which the parts that are not ``exchanged`` are as was assumed, with the ranges that are drawn about it."""
    kept = {name: row for part, rows in ASSUMED.items() if part not in exchanged for name, row in rows.items()}
    rig = Parameters().replace({name: value for name, (value, _, _) in kept.items()})
    return dataclasses.replace(rig, ranges=tuple((name, low, high) for name, (_, low, high) in kept.items()))


def measure(rig: str, controller: str, sensors: str, episodes: int, seed: int) -> Result:
    """``COLUMNS`` of a controller that believes a rig of ``EXCHANGED``; a lost head is infinitely bad."""
    nominal = rig_of(EXCHANGED[rig])
    found: dict[str, Any] = {}
    for environment in dict.fromkeys(one for one, _, _ in COLUMNS.values()):
        law = make_controller(controller, nominal)
        setting: Any = {"parameters": nominal, "sensors": sensors, "randomize": True}
        result = evaluate(environment, law, controller, episodes, seed, progress=False, **setting)
        for name, (own, metrics, _) in COLUMNS.items():
            if own == environment:
                largest = np.max([np.abs(result.metrics[metric]) for metric in metrics], axis=0)
                values = penalize_lost(largest, result.lost)
                found[name] = [quantile(values, 0.5), quantile(values, 0.95)]
    return {name: jsonable(row) for name, row in found.items()}


def _tasks(options: Options) -> dict[Any, Task]:
    return {
        (rig, controller, sensors): Task(
            f"{rig}-{controller}-{sensors}",
            measure,
            {"rig": rig, "controller": controller, "sensors": sensors, "episodes": options.episodes, "seed": options.seed},
        )
        for controller in options.controller
        for sensors in options.sensors
        for rig in EXCHANGED
    }


def _kept(_: Options, found: Found) -> Any:
    return [
        {"rig": rig, "controller": controller, "sensors": sensors, **result}
        for (rig, controller, sensors), result in found.items()
    ]


def _figures(row: dict[str, Any]) -> list[Cell]:
    return [row[name] for name in COLUMNS]


def _shown(content: Content) -> dict[str, str]:
    said = f"{worlds(content['settings']['seed'], content['settings']['episodes'])}."
    heads = [head for _, _, head in COLUMNS.values()]
    on_both = [Head(f"{head}, {rig}", SPREAD) for head in heads for rig in WHOLE]
    both: list[list[Cell | Head]] = [["controller", *information.COLUMNS, "sensors", *on_both]]
    found = {(row["controller"], row["sensors"], row["rig"]): row for row in content["figures"]}
    for controller, sensors in dict.fromkeys(key[:2] for key in found):
        before, after = (_figures(found[controller, sensors, rig]) for rig in WHOLE)
        facts = information.informed(controller, sensors)
        both.append([f"`{controller}`", *facts, sensors, *itertools.chain(*zip(before, after, strict=True))])
    parts: list[list[Cell | Head]] = [["sensors", "what was measured", *(Head(head, SPREAD) for head in heads)]]
    for (controller, sensors, rig), row in found.items():
        if controller == content["settings"]["controller"][-1]:
            parts.append([sensors, WORDS.get(rig, rig), *_figures(row)])
    alone = f"Part by part, `{content['settings']['controller'][-1]}`:"
    return {"measured-rig.md": f"{said}\n\n{markdown(both)}\n\n{alone}\n\n{markdown(parts)}\n"}


STUDY = Study(
    options={
        "controller": (
            "backstepping", "backstepping-weight", "backstepping-frozen", "pid", "lqr", "sliding-mode",
            "admittance-sensorless", "admittance-backstepping", "admittance-adaptive",
        ),
        "sensors": ("ideal", "lab", "honest"),
        "episodes": 32,
        "seed": SEED,
    },
    tasks=_tasks,
    keep=_kept,
    units={"settled": "mm", "stiffness": "%", "hunting": "mm"},
    show=_shown,
)  # fmt: skip
register(study="measured-rig", about="what the rig as measured does to controllers")(STUDY)
