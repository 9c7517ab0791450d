"""The ends of the benchmark's scale: settled errors of shut valves and of the best classical controller in every task.

Of the worlds of the split ``scale`` the first choose the best controller, and others, ``APART`` seeds later, measure it.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.feasibility import FEASIBLE
from baselines.bench.pieces import file_stem
from baselines.bench.statistics import crossed_interval
from baselines.named import make_controller, uses_force
from baselines.work.tasks import Result, Task
from birthsim.benchmark.scale import BEST, SHUT, counted_error
from birthsim.benchmark.suites import SUITES, TASKS, find_task
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from birthsim_env.splits import SCALE
from lab.engine.results import Content, written
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown
from lab.engine.worlds import worlds
from lab.studies.comparison.grid import default_controllers

APART = 1000
"""Seeds between the first world that chooses and the first that measures."""

STILL = "shut-valves"
FINDS_RIG = "admittance[finds_rig=true]"
"""A classical controller that has no name of its own, for rigs of two cylinders."""

_CAPTION = (
    "Settled errors, geometric mean over the feasible ones of {measured}, in brackets the 95 % interval over episodes. The "
    "best controller was chosen among all classical ones by {chosen}. *One point* is the factor between the "
    "errors of two scores that differ by one point."
)


def _candidates(task: str) -> list[str]:
    """Classical controllers that can do a task."""
    own = find_task(task)
    finds_rig = [] if own.rig.linkage.is_rail else [FINDS_RIG]
    return [name for name in (*default_controllers(), *finds_rig) if own.force_sensor or not uses_force(name)]


def _tasks(own: Sequence[str], options: Options) -> dict[Any, Task]:
    """Those that choose in ``own`` tasks: (task, controller) -> its piece."""
    return {
        (task, name): _task("chosen", task, name, options.choosing, options.seed) for task in own for name in _candidates(task)
    }


def _further(own: Sequence[str], options: Options, found: Found) -> dict[Any, Task]:
    """Those that measure, once the best are known: (task, role)."""
    if any(key[1] in (SHUT, BEST) for key in found):
        return {}
    every: dict[Any, Task] = {}
    for task in own:
        best = min(_candidates(task), key=lambda name: float(np.mean(found[task, name]["logs"])))
        for role, where, name in ((SHUT, _with_same_plants(task), STILL), (BEST, task, best)):
            every[task, role] = _task("measured", where, name, options.episodes, options.seed + APART)
    return every


def _with_same_plants(task: str) -> str:
    """The first task whose plants are those of a task; shut valves, which look at no sensor, have the same errors there."""
    own = find_task(task)
    alike = (own.environment, own.friction, own.ranges)
    return next(name for name, one in TASKS.items() if (one.environment, one.friction, one.ranges) == alike)


def _task(stage: str, task: str, name: str, episodes: int, seed: int) -> Task:
    settings = {"task": task, "controller": name, "episodes": episodes, "seed": seed}
    return Task(f"{stage}/{task}/{file_stem(name)}", measure_end, settings)


def measure_end(task: str, controller: str, episodes: int, seed: int) -> Result:
    """Logarithms of a controller's settled errors, mm, in the feasible worlds of a task."""
    own = find_task(task)
    world = own.world
    rig = Parameters.from_dict(world.pop("parameters")) if "parameters" in world else own.rig
    law = make_controller(controller, own.rig)
    result = evaluate(own.environment, law, controller, episodes, seed, progress=False, parameters=rig, **world)
    if len(result.seeds) < episodes:
        raise KeyboardInterrupt
    counted = counted_error(result.metrics["settled_rms"], result.lost)
    logs = np.log(counted[np.array(result.required_strength_ratio) <= FEASIBLE])
    return {"controller": controller, "logs": logs[~np.isnan(logs)].tolist()}


def _kept(_: Options, found: Found) -> Any:
    """Task -> role -> controller, error and interval."""
    kept: dict[str, Any] = {}
    for (task, role), result in found.items():
        if role in (SHUT, BEST):
            logs = np.array([result["logs"]])
            error, low, high = np.exp([np.mean(logs), *crossed_interval(lambda drawn: float(np.mean(drawn)), logs)]).tolist()
            own = {"controller": result["controller"], "error_mm": error, "low": low, "high": high, "episodes": logs.size}
            kept.setdefault(task, {})[role] = own
    return kept


def _shown(stem: str, content: Content) -> dict[str, str]:
    settings = content["settings"]
    said = _CAPTION.format(
        measured=worlds(settings["seed"] + APART, settings["episodes"]), chosen=worlds(settings["seed"], settings["choosing"])
    )
    rows = [["task", "shut valves: error, mm", "best classical controller", "its error, mm", "one point"]]
    for task, own in content["figures"].items():
        factor = (own[SHUT]["error_mm"] / own[BEST]["error_mm"]) ** 0.01
        rows.append([task, _error(own[SHUT]), f"`{own[BEST]['controller']}`", _error(own[BEST]), f"{factor:.3f}"])
    own = {name: content[name] for name in ("command", "commit", "date", "settings")}
    return {f"{stem}.md": f"{said}\n\n{markdown(rows)}\n", f"{stem}.json": written({**own, "tasks": content["figures"]})}


def _error(own: dict[str, Any]) -> str:
    return f"{own['error_mm']:.3g} [{own['low']:.3g}, {own['high']:.3g}]"


def _study(stem: str, *suites: str) -> Study:
    """Of some suites, whose tables and values stand in the files ``stem``."""
    own = [task.name for suite in suites for task in SUITES[suite]]
    return Study(
        {"choosing": 16, "episodes": 256, "seed": SCALE.first},
        partial(_tasks, own),
        _kept,
        {"error_mm": "mm", "low": "mm", "high": "mm", "episodes": ""},
        partial(_shown, stem),
        words={"choosing": "Worlds that choose the best controller", "episodes": "Worlds that measure it"},
        further=partial(_further, own),
    )


STUDY = _study("scale", "classic", "open")
register(study="scale", about="the ends of the benchmark's scale: shut valves, best")(STUDY)
register(study="scale-rail", about="the ends of the scale in the suite of one cylinder")(_study("scale_rail", "rail"))
