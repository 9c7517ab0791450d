"""The plant's step against others: errors of its motion, and metrics of every controller in the same worlds."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.bench.pieces import file_stem
from baselines.named import controlling_names
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.step import DEFAULT, STEPS
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.worlds import SEED
from lab.studies.accuracy.errors import LAWS, Course, errors
from lab.studies.comparison.grid import COMPARED, ENVIRONMENTS, settings_of
from lab.studies.step.pieces import closed_loops, courses, seconds
from lab.studies.step.tables import tables

MEASURED = (("rk4", 0.25e-3), ("rk3", 0.25e-3), ("rk3", STEPS["rk3"].seconds))
"""Methods and steps, s, whose error is measured, with the limits of the method's own step."""
EXACT = ("rk4", 1e-3 / 64)
"""What they are measured against."""
TURNS = 5
"""How often the kernel's time is taken of each step, in turns."""


def _tasks(options: Options) -> dict[Any, Task]:
    pieces: dict[Any, Task] = {}
    for method, step in (*MEASURED, EXACT):
        for law in LAWS:
            settings = {"method": method, "step": step, "law": law, "rigs": options.rigs, "seed": 0}
            pieces[(method, step), "courses", law] = Task(f"courses/{law}-{method}-{1e6 * step:.0f}", courses, settings)
    for turn in range(TURNS):
        for method in (DEFAULT, *options.beside):
            pieces[method, "seconds", turn] = Task(f"seconds/{method}-{turn}", seconds, {"method": method, "turn": turn})
    for name in options.controller:
        for member, own in settings_of(name, Parameters()).items():
            for method in (DEFAULT, *options.beside):
                settings = {
                    "method": method, "settings": own, "environments": list(options.env), "sensors": list(options.sensors),
                    "episodes": options.episodes, "seed": options.seed,
                }  # fmt: skip
                pieces[method, "loops", member] = Task(f"loops/{file_stem(member)}-{method}", closed_loops, settings)
    return pieces


def _kept(options: Options, found: Found) -> Any:
    members = dict.fromkeys(member for _, kind, member in found if kind == "loops")
    return {
        "courses": {law: courses_of(law, found) for law in LAWS},
        "seconds": {
            method: {
                lanes: [found[method, "seconds", turn][lanes] for turn in range(TURNS)] for lanes in found[method, "seconds", 0]
            }
            for method in (DEFAULT, *options.beside)
        },
        "loops": [row for member in members for row in loops_of(member, options.beside, found)],
    }


def courses_of(law: str, found: Found) -> dict[str, Any]:
    """Motion -> a row per method and step: median and largest error over the rigs that met no end stop."""
    shown: dict[str, Any] = {}
    for motion, exact in found[EXACT, "courses", law].items():
        reference, rows = _course(exact), []
        for method, step in MEASURED:
            pairs = errors(_course(found[(method, step), "courses", law][motion]), reference)
            position, pressure = ([float(np.median(row[reference.clear])), float(row[reference.clear].max())] for row in pairs)
            rows.append({"method": method, "step_s": step, "position_m": position, "pressure_relative": pressure})
        shown[motion] = {"rigs": int(reference.clear.sum()), "rows": rows}
    return shown


def _course(result: Result) -> Course:
    return Course(np.array(result["position"]), np.array(result["pressure"]), np.array(result["clear"]))


def loops_of(member: str, beside: Sequence[str], found: Found) -> list[dict[str, Any]]:
    """A row per place and metric: mean and scatter over worlds with the default step, and of the others' paired differences."""
    rows = []
    for place, usual in found[DEFAULT, "loops", member].items():
        environment, sensors = place.split()
        for metric, values in usual["metrics"].items():
            plain = _numbers(values)
            for method in beside:
                other = found[method, "loops", member][place]
                both = ~(np.isnan(plain) | np.isnan(_numbers(other["metrics"][metric])))
                both &= ~(np.array(usual["lost"]) | np.array(other["lost"]))
                if both.sum() > 1:
                    apart = (_numbers(other["metrics"][metric]) - plain)[both]
                    rows.append(
                        {
                            "controller": member, "environment": environment, "sensors": sensors, "metric": metric,
                            "step": method, "worlds": int(both.sum()),
                            "lost": [sum(usual["lost"]), sum(other["lost"])],
                            "mean": _digits(plain[both].mean()), "scatter": _digits(plain[both].std(ddof=1)),
                            "difference": _digits(apart.mean()), "spread": _digits(apart.std(ddof=1)),
                        }
                    )  # fmt: skip
    return rows


def _numbers(values: Sequence[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values])


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


def _shown(content: Content) -> dict[str, str]:
    return {"step.md": tables(content["figures"]) + "\n"}


STUDY = Study(
    {
        "beside": ("rk3", "fine"), "controller": tuple(controlling_names()), "env": ENVIRONMENTS, "sensors": COMPARED,
        "rigs": 8, "episodes": 16, "seed": SEED,
    },
    _tasks,
    _kept,
    {"position_m": "m", "pressure_relative": "", "step_s": "s", "seconds": "s"},
    _shown,
    allowed={"beside": [method for method in STEPS if method != DEFAULT]},
    words={"rigs": "random corners, and as many random rigs", "beside": "steps that controllers are measured with besides"},
)  # fmt: skip
register(study="step", about="the plant's step of integration beside other steps")(STUDY)
