"""The bench: controllers x environments x sensors x plants, every controller in the same worlds.

A cell is one controller in one environment, with one sensor model and one plant, over all seeds. The scenario varies from
episode to episode in every cell; the plant is the rig as its owner describes it, or drawn anew for every episode.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.files import WEIGHTS
from agents.policy.seeds import policy_folders
from agents.policy.shipped import SHIPPED
from baselines.bench.evaluation import evaluate
from baselines.bench.metrics import UNITS
from baselines.bench.pieces import controller_settings, file_hash, file_stem
from baselines.bench.statistics import penalize_lost
from baselines.named import controlling_names, make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.assembly import Arguments
from birthsim_env.parts.scenarios import environment_id, studied_scenarios
from birthsim_env.parts.sensors.model import drawn_by
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import shown
from lab.studies.comparison.paired import paired_ratios, summary_with_interval
from lab.studies.comparison.privileged import TOLD, can_be_privileged, evaluate_privileged

ENVIRONMENTS = tuple(environment_id(scenario) for scenario in studied_scenarios())
COMPARED = ("ideal", "lab")
"""Sensor models of the bench's tables where none is named."""
PLANTS: dict[str, bool | str] = {
    "nominal": "scenario",
    "randomised": True,
    "drawn-sensors": "sensors",
    "described-sensors": True,
}
"""Plant -> the environments' argument ``randomize``. The law believes the rig as described: what is ``randomised`` differs from
that in rig and sensors; where the sensor model can draw its figures, ``drawn-sensors`` in those alone, ``described-sensors`` in
all others."""

RIGS = {
    "nominal": "nominal rig",
    "randomised": "randomised rig",
    "drawn-sensors": "figures randomised, nominal rig",
    "described-sensors": "figures as described, randomised rig",
}
"""Plant -> its words in tables and pictures."""

MOVING = ("sine", "noise", "guided")
"""Hands that move all the time."""

LEARNED = "residual:"
"""Before the name of a policy, of which all training seeds are measured together."""

REFERENCE = "backstepping"
"""The law that the others are compared with, episode by episode."""

METRICS = {**UNITS, "hunting": "mm"}
"""Metric -> unit; ``hunting`` is the larger of the two axes."""


@dataclass(frozen=True)
class Conditions:
    """Where a controller is measured: environment id, sensor model, plant, one of ``PLANTS``, and what moves the hand, one of
    ``MOVING`` or "" for the environment's own hand."""

    environment: str
    sensors: str
    plant: str
    hand: str = ""

    def __str__(self) -> str:
        return f"{self.short}, {known(self.sensors, self.plant)}{f', moving hand: {self.hand}' if self.hand else ''}"

    @property
    def short(self) -> str:
        """The environment without prefix and version."""
        return re.sub(r"^BirthSIM/|-v\d+$", "", self.environment)


def known(sensors: str, plant: str) -> str:
    """Sensor model and plant in words: ``honest sensors, nominal rig``."""
    return f"{sensors} sensors, {RIGS[plant]}"


@dataclass(frozen=True)
class Cell:
    """A controller's episodes under some conditions: metric -> value per episode, which are lost, and us per lane and call."""

    controller: str
    conditions: Conditions
    metrics: dict[str, list[float]]
    lost: list[bool]
    cost: float


Cells = dict[tuple[str, Conditions], Cell]

CONDITIONAL = ("stiffness_error", "cross_motion", "unrest", "hunting_x", "hunting_y", "hunting", "restarts")
"""Metrics of which some environments say nothing: they apply where any episode of any controller says something."""

WITHOUT_RATIO = ("restarts", "saturation")
"""Metrics that are zero for a good controller: a ratio to zero says nothing."""


def default_controllers() -> list[str]:
    """Every controller that is compared but the planner, which has a page of its own."""
    return [name for name in controlling_names() if name != "nonlinear-mpc"]


def all_conditions(
    environments: Sequence[str] = ENVIRONMENTS, sensors: Sequence[str] = COMPARED, plants: Sequence[str] = tuple(PLANTS)
) -> list[Conditions]:
    """Every combination that there is, and the moving hands on rigs drawn at random where the circle is among them."""
    own = [
        Conditions(*chosen)
        for chosen in product(environments, sensors, plants)
        if not chosen[2].endswith("-sensors") or drawn_by(chosen[1])
    ]
    where = [name for name in environments if name == ENVIRONMENTS[0]]
    moving = product(where, sensors, [name for name in plants if PLANTS[name] is True], MOVING)
    return [*own, *(Conditions(*chosen) for chosen in moving if not chosen[2].endswith("-sensors") or drawn_by(chosen[1]))]


def settings_of(name: str, rig: Parameters) -> dict[str, dict[str, Any]]:
    """Name -> settings of what is measured under a name: a controller's ``controller_settings``, or for "residual:POLICY" those
    of the policies of all its training seeds. ``ValueError`` for what is neither."""
    if not name.startswith(LEARNED):
        plain, told = name.removeprefix(TOLD), name.startswith(TOLD)
        own = controller_settings(plain, rig)
        if told and not can_be_privileged(plain, rig):
            raise ValueError(
                f"controller = {shown(name)}; allowed: {TOLD} before a compiled controller without policy and limits"
            )
        return {name: {**own, "policy": "", "told": told}}
    folders = policy_folders(name.removeprefix(LEARNED))
    own = {"controller": "residual", "rig": rig.to_dict(), "told": False}
    return {
        f"{name} {place.name}": {**own, "source": file_hash(str(place / WEIGHTS)), "policy": _place(place)} for place in folders
    }


def _place(folder: Path) -> str:
    """A policy's folder from that of the shipped ones, if it is one of these."""
    return str(folder.relative_to(SHIPPED)) if folder.is_relative_to(SHIPPED) else str(folder)


def as_described(rig: Parameters) -> Parameters:
    """``rig`` whose sensors stay as they are described where everything else of it is drawn."""
    board = rig.to_dict()["electronics"]
    ranges = {f"electronics.{name}": [board.get(name, getattr(rig.electronics, name))] * 2 for name in SENSOR_PARAMETERS}
    return Parameters.from_dict({**rig.to_dict(), "randomize": ranges})


def cell_task(settings: dict[str, Any], conditions: Conditions, episodes: int, seed: int) -> Task:
    """The task that computes one cell of a controller with its ``settings_of``."""
    name = " ".join(filter(None, (TOLD * settings["told"] + settings["controller"], settings["policy"])))
    where = {
        "environment": conditions.environment, "sensors": conditions.sensors, "plant": conditions.plant, "hand": conditions.hand
    }  # fmt: skip
    stem = f"cells/{file_stem(name)}/{'-'.join(filter(None, (conditions.short, *list(where.values())[1:])))}"
    return Task(stem, run_cell, {**settings, **where, "episodes": episodes, "seed": seed})


def run_cell(
    controller: str,
    source: str,
    policy: str,
    told: bool,
    rig: dict[str, Any],
    environment: str,
    sensors: str,
    plant: str,
    hand: str,
    episodes: int,
    seed: int,
) -> Result:
    """Values, returns and success per episode, lost ones and cost of one cell; ``source`` only tells different files apart."""
    believed = Parameters.from_dict(rig)
    parameters = as_described(believed) if plant == "described-sensors" else believed
    setting: Arguments = {"parameters": parameters, "sensors": sensors, "randomize": PLANTS[plant], "user_force": hand or None}
    if told and PLANTS[plant] is True:
        result = evaluate_privileged(environment, controller, parameters, range(seed, seed + episodes), setting)
    else:
        law = make_controller(controller, believed, **({"policy": SHIPPED / policy} if policy else {}))
        result = evaluate(environment, law, controller, episodes, seed, progress=False, **setting)
    if len(result.seeds) < episodes:
        raise KeyboardInterrupt  # which ``evaluate`` answers by what is complete; a cell is complete or it is none
    returns = {str(discount): values for discount, values in result.returns.items()}
    return {
        "seeds": result.seeds, "metrics": result.metrics, "lost": result.lost, "cost": result.cost, "success": result.success,
        "returns": returns,
    }  # fmt: skip


def gather(named: dict[tuple[str, Conditions], Result]) -> Cells:
    """Cells from the results of ``run_cell``; what says nothing is NaN."""
    cells = {}
    for (controller, conditions), result in named.items():
        values = {metric: [np.nan if v is None else v for v in column] for metric, column in result["metrics"].items()}
        values["hunting"] = np.fmax(values["hunting_x"], values["hunting_y"]).tolist()
        cells[controller, conditions] = Cell(controller, conditions, values, result["lost"], result["cost"])
    return cells


def costs(cells: Cells) -> dict[str, float]:
    """Controller -> median over its cells of its time per lane and call, us, which differs from run to run."""
    names = dict.fromkeys(name for name, _ in cells)
    return {name: float(np.median([cell.cost for cell in cells.values() if cell.controller == name])) for name in names}


def statistics(cells: Cells) -> list[dict[str, Any]]:
    """Per cell its figures, for tables and JSON.

    ``metrics`` holds, per metric that applies in the environment, the ``summary_with_interval`` of its sizes, lost episodes
    infinitely bad; ``ratios`` that of the paired ratios to ``REFERENCE``, where that law ran and the metric has one.
    """
    applicable = {
        (cell.conditions.environment, metric)
        for cell in cells.values()
        for metric, values in cell.metrics.items()
        if np.isfinite(values).any()
    }
    found = []
    for (controller, conditions), cell in cells.items():
        reference = cells.get((REFERENCE, conditions))
        figures: dict[str, Any] = {"metrics": {}, "ratios": {}}
        for metric in METRICS:
            if metric in CONDITIONAL and (conditions.environment, metric) not in applicable:
                continue
            mine = penalize_lost(cell.metrics[metric], cell.lost, applies=True)
            figures["metrics"][metric] = summary_with_interval(mine)
            if reference is not None and controller != REFERENCE and metric not in WITHOUT_RATIO:
                theirs = penalize_lost(reference.metrics[metric], reference.lost, applies=True)
                theirs = np.tile(theirs, len(mine) // len(theirs))  # the same worlds for every training seed
                figures["ratios"][metric] = summary_with_interval(paired_ratios(mine, theirs))
        found.append(
            {
                "controller": controller,
                "environment": conditions.environment,
                "sensors": conditions.sensors,
                "plant": conditions.plant,
                "hand": conditions.hand,
                "episodes": len(cell.lost),
                "lost": int(sum(cell.lost)),
                **figures,
            }
        )
    return found
