"""How controllers err on a rail, level, sloping and upright: in following a target, in stiffness, and by hunting at rest."""

import math
from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import controller_settings, file_stem
from baselines.bench.probes import run_stiffness_test
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim.commands.tune import probes
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import RAIL
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import worlds

SENSORS = "encoders"

TILTS = (0.0, 30.0, 90.0)
"""Degrees above x: none of the weight along the rail, half of it, all of it."""

CONTROLLERS = ("admittance", "pid", "admittance-sensorless", "abry", "backstepping")

UNITS = {"error": "mm", "stiffness": "%", "hunting": "mm"}


def rail(tilt: float) -> Parameters:
    """The bench that controllers believe in, ``tilt`` degrees above x."""
    return Parameters().replace({"linkage.kind": RAIL, "linkage.inclination": math.radians(tilt)})


def measure(controller: str, source: str, rig: dict[str, Any], seed: int, lanes: int) -> Result:
    """Of worlds with the seeds ``seed`` on, lists over them by names of ``UNITS``, infinite where lost, and the lost episodes.

    ``source`` only tells controllers of different files apart.
    """
    bench = Parameters.from_dict(rig)
    setting: Any = {"sensors": SENSORS, "parameters": bench, "randomize": True}
    followed = evaluate(environment_id(RAIL), make_controller(controller, bench), controller, lanes, seed, False, **setting)
    if len(followed.seeds) < lanes:
        raise KeyboardInterrupt  # which ``evaluate`` answers by what is complete; a piece is complete or it is none
    tests = probes(bench, lanes, seed)
    pushed = run_stiffness_test(tests, make_controller(controller, bench), SENSORS, seed)
    error = penalize_lost(np.array(followed.metrics["settled_rms"]), np.array(followed.lost), applies=True)
    stiffness = 100.0 * np.abs(pushed.stiffness_error(tests.force))
    hunting = 1e3 * penalize_lost(pushed.hunting.max(axis=0), pushed.lost, applies=True)
    columns = {"error": error, "stiffness": stiffness, "hunting": hunting}
    return {**{name: values.tolist() for name, values in columns.items()}, "lost": list(followed.lost)}


def _tasks(options: Options) -> dict[Any, Task]:
    found = {}
    for controller in options.controller:
        for tilt in TILTS:
            own = controller_settings(controller, rail(tilt))
            more = {"seed": options.seed, "lanes": options.episodes}
            found[controller, tilt] = Task(f"{file_stem(controller)}-{tilt:g}", measure, {**own, **more})
    return found


def _kept(options: Options, found: Found) -> Any:
    figures = []
    for (controller, tilt), result in found.items():
        # Pieces are kept as JSON, in which an infinite number is none.
        columns = {name: [math.inf if one is None else one for one in result[name]] for name in UNITS}
        own = {name: [quantile(values, share) for share in (0.5, 0.95)] for name, values in columns.items()}
        figures.append({"controller": controller, "tilt": tilt, **own, "lost": sum(result["lost"])})
    return jsonable(figures)


def _shown(content: Content) -> dict[str, str]:
    settings, units = content["settings"], content["units"]
    heads = [Head(f"{name} at {tilt:g} degrees, {units[name]}", SPREAD) for name in UNITS for tilt in TILTS]
    heads.append(Head("lost", tuple(f"at {tilt:g} degrees" for tilt in TILTS)))
    table: list[list[Cell | Head]] = [["controller", *information.COLUMNS, *heads]]
    found = {(one["controller"], one["tilt"]): one for one in content["figures"]}
    for controller in settings["controller"]:
        own = [found[controller, tilt] for tilt in TILTS]
        told = [one[name] for name in UNITS for one in own]
        facts = information.informed(controller, SENSORS)
        table.append([f"`{controller}`", *facts, *told, [str(one["lost"]) for one in own]])
    said = (
        f"{worlds(settings['seed'], settings['episodes'])}, {SENSORS}, benches drawn. 95 % is the 95th percentile. "
        "*Error*: settled. *Stiffness*: how far the rendered one is from the setpoint in a test of 7 s on the same benches, "
        "with 5 to 40 N after 3 s and setpoints of 1000 to 4000 N/m. *Hunting*: peak to peak in a second before that push or "
        "under it, along x or y. *Lost*: episodes in which the piston hit its end stop, at each inclination. "
        f"{information.LEGEND}"
    )
    return {"rail-error.md": f"{said}\n\n{markdown(table)}\n"}


STUDY = Study(
    {"controller": CONTROLLERS, "episodes": 64, "seed": 771_000},
    _tasks,
    _kept,
    UNITS,
    _shown,
    words={"episodes": "worlds that are drawn"},
)
register(study="rail-error", about="how controllers err on a rail in target and stiffness")(STUDY)
