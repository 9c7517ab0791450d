"""The card of a trained policy, in the format of the Hugging Face Hub: what it was trained on, where it is better and worse."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.files import read_policy
from agents.residual.settings import NO_LAW
from baselines.bench.evaluation import Evaluation, evaluate
from baselines.bench.statistics import penalize_lost, quantile
from baselines.named import make_controller, uses_force
from birthsim_env import __version__, reference_returns
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import shown
from birthsim_env.scores import BEST, SENSORS, is_scored

TRAINING = "training.json"
"""What a training writes beside a policy."""

_TRAINED_ON = {"settings": {"sensors": str, "randomize": (bool, str), "rig": dict, "algorithm?": (str, None)}}

EPISODES, SEED = 64, 75_900_000
"""Of the comparison; no training, validation or design had these worlds."""

METRICS = {
    "settled_rms median": ("settled error, median", "mm"),
    "settled_rms q95": ("settled error, 95th percentile", "mm"),
    "stiffness_error median": ("stiffness error, median", "%"),
    "hunting_x median": ("hunting along x, median", "mm"),
    "hunting_y median": ("hunting along y, median", "mm"),
    "saturation median": ("time with a valve at its limit, median", "%"),
    "air median": ("air, median", "normal l/min"),
    "lost": ("lost episodes", "%"),
}
"""Figure, as the hub's metric -> its name and unit; the smaller, the better."""


def compared(folder: Path) -> list[Evaluation]:
    """A policy, the law that it corrects, the paper's, the one without a force sensor where it has none, and the best one.

    All meet the same worlds, of the kind that its training had. Raises ``ValueError`` where the training left no settings.
    """
    policy = read_policy(folder)
    about = settings_of(folder)
    try:
        sensors, randomize, rig = about["sensors"], about["randomize"], Parameters.from_dict(about["rig"])
    except ValueError as error:
        problem = f"policy = {shown(str(folder))}: its {TRAINING} has no rig ({error})"
        raise ValueError(f"{problem}; allowed: as birthsim train writes it") from error
    place = policy.environment.replace("Residual", "")
    beside = [policy.settings.law, "backstepping", *["admittance-sensorless"] * (not policy.settings.force_sensor)]
    if is_scored(place):
        known = reference_returns(place, sensors if sensors in SENSORS else SENSORS[-1], bool(randomize))
        beside.append(known[BEST]["controller"])
    controllers = {"this policy": make_controller("residual", rig, policy=str(folder))}
    controllers |= {name: make_controller(name, rig) for name in beside if name != NO_LAW}
    return [
        evaluate(place, controller, who, EPISODES, SEED, sensors=sensors, randomize=randomize, parameters=rig)
        for who, controller in controllers.items()
    ]


def model_card(folder: Path, name: str, evaluations: Sequence[Evaluation]) -> str:
    """The text of ``README.md`` beside a policy, from what ``compared`` found."""
    policy = read_policy(folder)
    about = settings_of(folder)
    whom, columns = [one.controller for one in evaluations], [metrics(one) for one in evaluations]
    rows = {key: [column[key] for column in columns] for key in METRICS if np.isfinite(columns[0][key])}
    result = {
        "task": {"type": "reinforcement-learning", "name": "stiffness control"},
        "dataset": {"type": "gymnasium", "name": policy.environment},
        "metrics": [{"type": key, "name": METRICS[key][0], "value": row[0]} for key, row in rows.items()],
    }
    force = [policy.settings.force_sensor, *(uses_force(who) for who in whom[1:])]
    table = [
        f"| | {' | '.join(whom)} |",
        "|---|" + "---|" * len(whom),
        f"| uses the hand's force | {' | '.join('yes' if one else 'no' for one in force)} |",
        *(f"| {', '.join(METRICS[key])} | {' | '.join(map(_number, row))} |" for key, row in rows.items()),
    ]
    law, network = policy.settings.law, policy.network
    made = about.get("algorithm") or "imitation of teachers"
    return "\n".join(
        [
            "---",
            "license: mit",
            "library_name: birthsim",
            "pipeline_tag: reinforcement-learning",
            "tags: [reinforcement-learning, gymnasium, haptics, birthsim]",
            f"model-index: {json.dumps([{'name': name, 'results': [result]}])}",
            "---",
            "",
            f"# {name}",
            "",
            f"This policy {'drives the valves by itself' if law == NO_LAW else f'corrects the controller `{law}`'} "
            f"in `{policy.environment}` of BirthSIM {__version__}, at {1 / policy.settings.policy_period:g} Hz.",
            f"It was trained by {made}, with `sensors={about['sensors']!r}`, `randomize={about['randomize']}`.",
            f"It takes {network.inputs} observations and gives {network.outputs} actions.",
            "",
            *table,
            "",
            f"All met the same worlds: {EPISODES} episodes from seed {SEED}, of the kind that the training had, without those "
            "that ask for more than the rig's strength. No training, validation or design had them.",
            "",
            *(f"- {_said(who, rows, k)}" for k, who in enumerate(whom) if k),
            "- A small error does not say what a hand feels; in a clone, `birthsim study haptics` measures that.",
            "- It is a policy of a simulation. No real rig has run it, and it is no medical device.",
            "",
            f"      birthsim evaluate --controller {' '.join(whom[1:])} residual --policy FOLDER --sensors {about['sensors']}",
            "",
        ]
    )


def settings_of(folder: Path) -> dict[str, Any]:
    """The settings of the training that left a policy; ``ValueError`` where they are missing or damaged."""
    if not (folder / TRAINING).is_file():
        raise ValueError(f"policy = {shown(str(folder))}; allowed: a folder with {TRAINING}, as birthsim train writes it")
    settings: dict[str, Any] = read_json("policy", folder / TRAINING, _TRAINED_ON)["settings"]
    return settings


def metrics(evaluation: Evaluation) -> dict[str, float]:
    """The metrics of a card over the episodes that the rig's strength suffices for; a lost one is infinitely bad."""
    feasible = np.asarray(evaluation.required_strength_ratio) < 1.0
    found = {"lost": 100 * float(np.mean(np.asarray(evaluation.lost)[feasible]))}
    for metric, statistic in (key.split() for key in METRICS if key != "lost"):
        sizes = np.abs(penalize_lost(evaluation.metrics[metric], evaluation.lost))[feasible]
        found[f"{metric} {statistic}"] = quantile(sizes, 0.95 if statistic == "q95" else 0.5)
    return found


def _said(who: str, rows: dict[str, list[float]], column: int) -> str:
    """In which metrics the policy is better and worse than the one of a column."""
    better = "; ".join(METRICS[key][0] for key, row in rows.items() if row[0] < row[column])
    worse = "; ".join(METRICS[key][0] for key, row in rows.items() if row[0] > row[column])
    return f"Beside `{who}` it is better in: {better or 'nothing'}. It is worse in: {worse or 'nothing'}."


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "lost" if np.isinf(value) else ""
