"""A rig without a force sensor under controllers that are told what ``birthsim identify`` finds in 5 s of its own log."""

from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.work.tasks import Task
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.studies.comparison.grid import as_described
from lab.studies.recovery.study import recovery_table
from lab.studies.sensorless.own_logs import identified, measure
from lab.studies.sensorless.study import RIGS, kept, stem_of, tables
from lab.studies.sensorless.study import STUDY as SENSORLESS

LANES = 32
"""Worlds of a piece."""


def _logs(options: Options) -> dict[Any, Task]:
    seeds = range(options.seed, options.seed + options.episodes)
    return {seed: Task(f"logs/{seed}", identified, {"duration": options.duration, "seed": seed}) for seed in seeds}


def _felt(options: Options, found: Found) -> dict[Any, Task]:
    """Once there are logs, their worlds under every controller."""
    tasks, last = dict[Any, Task](), options.seed + options.episodes
    for rig, (controller, file) in RIGS.items():
        own = controller_settings(controller, as_described(load_parameters(ROOT / file if file else None)))
        for first in range(options.seed, last, LANES):
            told = [found[seed]["rig"] for seed in range(first, min(first + LANES, last))]
            more = {"told": told, "force_sensor": rig == "force", "seed": first}
            tasks[rig, "identified", first] = Task(f"{stem_of(rig)}/{first}", measure, {**own, **more})
    return {} if tasks.keys() <= found.keys() else tasks


def _kept(options: Options, found: Found) -> Any:
    pieces = {key: result for key, result in found.items() if isinstance(key, tuple)}
    logs = [{name: found[seed][name] for name in ("rows", "misfit")} for seed in _logs(options)]
    return {"felt": kept(("identified",), pieces), "logs": logs}


def _shown(content: Content) -> dict[str, str]:
    found, ranges = content["figures"], documented_ranges(as_described(Parameters()))
    return {
        "identified.md": tables(found["felt"], content["settings"])
        + "\n"
        + "\n".join(recovery_table(found["logs"], ranges))
        + "\n"
    }


STUDY = Study(
    {"duration": 5.0, "episodes": 256, "seed": 936000},
    _logs,
    _kept,
    {**SENSORLESS.units, "misfit": "of the log's noise", "value": "the parameter's"},
    _shown,
    further=_felt,
    words={"duration": "s of each log", "episodes": "drawn worlds"},
)
register(study="identified", about="what a hand feels once a rig is identified from its own log")(STUDY)
