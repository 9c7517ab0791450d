"""How well gradients through closed loops agree with differences: all scenarios, and every controller under all sensors."""

from typing import Any

import numpy as np

from agents.residual.env import ResidualVectorEnv
from baselines.bench.statistics import quantile
from baselines.named import LIMITED
from baselines.work.tasks import Result, Task
from birthsim_env.parts.scenarios import environment_id, studied_scenarios
from birthsim_env.registry import names, register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown
from lab.studies.comparison.grid import default_controllers
from lab.studies.gradients.loops import SIZES, begun, compared

CIRCLE = "BirthSIM/Circle-v2"
ENVIRONMENTS = tuple(environment_id(name) for name in studied_scenarios())

STEPPING = {"iterative-learning"}
"""Loops over as many bins as the lap had have no graph of a fixed length, so that their gradients are refused."""

CONTROLLERS = (
    *(name for name in default_controllers() if name not in STEPPING),
    *(f"{LIMITED}pid", f"{LIMITED}admittance-adaptive"),
)

NEAR = 1e-6
"""Relative error up to which a gradient agrees with a difference."""


def agreement(lanes: int, steps: int, begins: int, **arguments: Any) -> Result:
    """Of gradients over ``steps`` policy steps, ``begins`` after episodes began: median error, beside differences of each size
    and the best of them, and shares of the lanes that agree with the middle difference, and with one of the three."""
    off, equal = compared(begun(lanes=lanes, steps=begins, **arguments), steps)
    least = off.min(axis=0)
    shares = {"middle": float(np.mean(off[1] < NEAR)), "any": float(np.mean(least < NEAR))}
    found = {"lanes": off.shape[1], "median": quantile(least, 0.5), "sizes": [quantile(one, 0.5) for one in off]}
    return {"equal": equal, **found, **shares, "worst": float(least.max())}


def _tasks(options: Options) -> dict[Any, Task]:
    loops = {name: {"world": name, "lanes": options.states, "steps": 1, "begins": 300} for name in ENVIRONMENTS}
    loops["a hand that feels"] = {**loops[CIRCLE], "user_force": "guided"}
    for name in CONTROLLERS:
        for sensors in names("sensors"):
            loop = {"world": CIRCLE, "controller": name, "sensors": sensors, "lanes": options.lanes, "steps": 4, "begins": 20}
            loops[f"{name}, {sensors}"] = loop
    return {name: Task(f"agreement{k}", agreement, loop) for k, (name, loop) in enumerate(loops.items())}


def _kept(options: Options, found: Found) -> Any:
    return {name: dict(result) for name, result in found.items()}


def _shown(content: Content) -> dict[str, str]:
    sizes = ", ".join(f"{size:.0e}" for size in SIZES)
    rows = [
        [
            "",
            "lanes",
            "median error",
            f"by size of the difference: {sizes}",
            "within 1e-6 of one difference",
            "of one of three",
            "largest error",
            "bit-identical",
        ]
    ]
    for name, one in content["figures"].items():
        shares = (f"{100 * one[share]:.1f} %" for share in ("middle", "any"))
        ends = f"{one['worst']:.0e}", "yes" if one["equal"] else "NO"
        by_size = ", ".join(f"{median:.0e}" for median in one["sizes"])
        rows.append([name.removeprefix("BirthSIM/"), f"{one['lanes']}", f"{one['median']:.0e}", by_size, *shares, *ends])
    return {"gradients_checks.md": markdown(rows) + "\n"}


UNITS = {"equal": "1", "lanes": "1", "median": "1", "sizes": "1", "middle": "1", "any": "1", "worst": "1"}
STUDY = Study({"states": 1000, "lanes": 256}, _tasks, _kept, UNITS, _shown, beside=(ResidualVectorEnv,))
register(study="gradients-checks", about="gradients through closed loops beside differences")(STUDY)
