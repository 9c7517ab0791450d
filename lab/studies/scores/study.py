"""What every environment pays to shut valves, to every controller and to the shipped policies."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from agents.policy.files import WEIGHTS, read_policy
from agents.policy.seeds import policy_folders
from agents.policy.shipped import SHIPPED
from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import file_hash, file_stem
from baselines.bench.statistics import penalize_lost, summarize
from baselines.named import make_controller, uncontrolled_names
from baselines.work.tasks import Result, Task
from birthsim_env.ids import rig_for
from birthsim_env.parts.scenarios import environment_id, scored_scenarios
from birthsim_env.registry import names, register
from birthsim_env.scores import RIGS, ROLES, SENSORS
from birthsim_env.splits import SCALE
from lab.engine.results import Content, written
from lab.engine.study import Found, Options, Study
from lab.studies.comparison.grid import default_controllers
from lab.studies.scores.tables import Scored, data, informed, overview

REFERENCE = "reference_returns.json"
"""What stands in ``birthsim_env/scores.json``."""

Rows = dict[str, dict[str, Any]]
"""Controller -> its figures in one environment under one condition."""

_CAPTION = (
    "{episodes} episodes from seed {seed}. Where the rig is randomised, so is the scenario. Controllers run at 1 kHz; random "
    "openings last 10 ms. Discounts are per 10 ms. The error is the settled error, median over the episodes. A success is an "
    "episode with less than 1 mm. The score is 0 for shut valves and 100 for the best controller. One half of the episodes "
    "chooses the best controller and the best policy, the other half measures them."
)


def _tasks(options: Options) -> dict[Any, Task]:
    if options.episodes < 2:
        raise ValueError(f"--episodes {options.episodes}; allowed: 2 or more, half of them choose the best controller")
    scored = map(environment_id, scored_scenarios())
    conditions = [(name, sensors, rig) for name in scored for sensors in SENSORS for rig in RIGS]
    return {
        (where, controller): _task(where, controller, policy, options)
        for where in conditions
        for controller, policy in _contestants(where[0])
    }


def _contestants(environment: str) -> Iterable[tuple[str, str]]:
    """Names and policy folders ("" for a law) of whatever is measured in an environment: of policies, those that were trained
    with sensors of the table."""
    for law in (*uncontrolled_names(), *default_controllers()):
        yield law, ""
    for name in names("policy"):
        if name.partition("_")[0] == _short(environment).lower():
            for folder in (one for one in policy_folders(name) if read_policy(one).training["sensors"] in SENSORS):
                yield f"{name} {folder.name}", f"{name}/{folder.name}"


def _task(where: tuple[str, str, bool], controller: str, policy: str, options: Options) -> Task:
    environment, sensors, randomize = where
    stem = f"cells/{file_stem(controller)}/{environment.removeprefix('BirthSIM/')}-{sensors}-{RIGS[randomize]}"
    settings = {
        "controller": controller, "policy": policy, "environment": environment, "sensors": sensors, "randomize": randomize,
        "episodes": options.episodes, "seed": options.seed,
        "network": file_hash(str(SHIPPED / policy / WEIGHTS)) if policy else "",
    }  # fmt: skip
    return Task(stem, score_cell, settings)


def score_cell(
    controller: str, policy: str, environment: str, sensors: str, randomize: bool, episodes: int, seed: int, network: str
) -> Result:
    """Figures of one controller in one environment under one condition; ``policy`` is a shipped policy's folder or "", and its
    ``network``'s hash only tells results of different policies apart."""
    rig = rig_for(environment, None)
    law = make_controller("residual", rig, policy=SHIPPED / policy) if policy else make_controller(controller, rig)
    result = evaluate(environment, law, controller, episodes, seed, progress=False, sensors=sensors, randomize=randomize)
    if len(result.seeds) < episodes:
        raise KeyboardInterrupt
    error = summarize(penalize_lost(result.metrics["settled_rms"], result.lost, applies=True))["median"]
    return {
        "returns": {str(discount): float(np.mean(values)) for discount, values in result.returns.items()},
        "halves": [float(np.mean(result.returns[1.0][part::2])) for part in (0, 1)],
        "error": error if np.isfinite(error) else None, "lost": float(np.mean(result.lost)),
        "success": float(np.mean(result.success)),
    }  # fmt: skip


def _kept(_: Options, found: Found) -> Any:
    """Scenario -> sensors -> rig -> controller -> its figures."""
    kept: dict[str, Any] = {}
    for ((name, sensors, rig), controller), result in found.items():
        place = kept.setdefault(_short(name), {}).setdefault(sensors, {}).setdefault(RIGS[rig], {})
        place[controller] = result
    return kept


def _short(environment: str) -> str:
    return environment.removeprefix("BirthSIM/").rpartition("-v")[0]


def _roles(rows: Rows) -> dict[str, dict[str, Any]]:
    """Who plays which of ``ROLES``: the best are chosen by one half of the episodes, all are measured by the other.

    Without policies there is no best one.
    """

    def best(names: Iterable[str]) -> str:
        return max(names, key=lambda name: float(rows[name]["halves"][0]))

    laws = [name for name in default_controllers() if name in rows]
    learned = [name for name in rows if name not in laws and name not in uncontrolled_names()]
    chosen = ("shut-valves", "random-valves", "backstepping", best(laws), *([best(learned)] if learned else []))
    return {
        role: {
            "controller": name,
            "return": rows[name]["halves"][1],
            **{key: rows[name][key] for key in ("error", "lost", "success")},
        }
        for role, name in zip(ROLES, chosen, strict=False)
    }


def _shown(content: Content) -> dict[str, str]:
    found = [
        Scored(short, sensors, rig, rows, _roles(rows))
        for short, by_sensors in content["figures"].items()
        for sensors, by_rig in by_sensors.items()
        for rig, rows in by_rig.items()
    ]
    scores: dict[str, Any] = {}
    for one in found:
        scores.setdefault(one.scenario, {}).setdefault(one.sensors, {})[one.rig] = one.roles
    own = {name: content[name] for name in ("command", "commit", "date", "settings")}
    linked = "Every controller, with its returns: [scores.csv](data/scores.csv)"
    text = "\n\n".join((_CAPTION.format(**content["settings"]), overview(found), informed(found), linked))
    return {"scores.md": text + "\n", "scores.csv": data(found), REFERENCE: written({**own, "scores": scores})}


STUDY = Study(
    {"episodes": 64, "seed": SCALE.first},
    _tasks,
    _kept,
    {"returns": "reward", "halves": "reward", "error": "mm", "lost": "", "success": ""},
    _shown,
)
register(study="scores", about="what every environment pays to whom")(STUDY)
