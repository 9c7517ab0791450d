"""birthsim study scores: what every environment pays to shut valves, to every law and to the shipped policies."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.files import WEIGHTS, load_policy
from agents.policy.seeds import SHIPPED, policy_folders, shipped_names
from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import file_hash, file_stem
from baselines.bench.statistics import penalize_lost, summarize
from baselines.commands.shared import EPISODES, JOBS, add_processes, policy_of, run, seed_number, whole_up_to
from baselines.registry import UNCONTROLLED, make_controller
from baselines.work.files import make_folder, own_folder, whole_results, write_json, write_text
from baselines.work.tasks import Result, Task, code_stamp, run_tasks
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.scores import RIGS, ROLES, SENSORS
from studies.comparison.grid import ENVIRONMENTS, default_controllers
from studies.scores.tables import Scored, data, overview

Rows = dict[str, dict[str, Any]]
"""Controller -> its figures in one environment under one condition."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim study scores",
        description="Measure what every environment pays: shut, slammed and random valves, every law that is not slow, and the "
        "policies that come with the package, with every sensor model, on the nominal rig and on rigs drawn at random.",
        epilog="What the output folder holds of the same settings and code is kept, so that an interrupted run goes on.",
    )
    parser.add_argument(
        "--episodes", type=whole_up_to(EPISODES), default=64, help="per controller and condition (default: %(default)s)"
    )
    parser.add_argument("--seed", type=seed_number, default=70000, help="seed of the first episode (default: %(default)s)")
    add_processes(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder for scores.json, scores.csv and scores.md")
    run(parser, _scores)


def _scores(arguments: argparse.Namespace) -> None:
    if arguments.episodes < 2:
        raise ValueError(f"--episodes {arguments.episodes}; allowed: 2 or more, half of them choose the best law")
    folder = make_folder(arguments.out)
    conditions = [(name, sensors, rig) for name in ENVIRONMENTS for sensors in SENSORS for rig in RIGS]
    tasks = {
        (where, controller): _task(where, controller, seed, arguments)
        for where in conditions for controller, seed in _contestants(where[0])
    }  # fmt: skip
    with own_folder(folder):
        done, failures = run_tasks(list(tasks.values()), folder, arguments.jobs or JOBS, "scores", arguments.cluster)
    if failures:
        name, problem = next(iter(failures.items()))
        raise ValueError(f"{len(failures)} of {len(tasks)} pieces failed, the first {name}: {problem}")
    scores: dict[str, Any] = {}
    found = []
    for where in conditions:
        name, sensors, rig = where
        rows = {controller: done[task.name] for (place, controller), task in tasks.items() if place == where}
        short = name.removeprefix("BirthSIM/").rpartition("-v")[0]
        known = _roles(rows)
        scores.setdefault(short, {}).setdefault(sensors, {})[RIGS[rig]] = known
        found.append(Scored(short, sensors, RIGS[rig], rows, known))
    text = f"{_CAPTION.format(episodes=arguments.episodes, seed=arguments.seed)}\n\n{overview(found)}"
    with whole_results(folder) as place:
        write_json(place / "scores.json", {"code": code_stamp(__name__), "seed": arguments.seed, "scores": scores})
        write_text(place / "scores.csv", data(found))
        write_text(place / "scores.md", f"# Scores\n\n{text}\n\nEvery controller, with its returns: [scores.csv](scores.csv)\n")
    print(text)


_CAPTION = (
    "{episodes} episodes from seed {seed}. Where the rig is drawn, so is the scenario. Laws run at 1 kHz; random openings last "
    "10 ms. Discounts are per 10 ms. The error is the settled error, median over the episodes. A success is an episode with "
    "less than 1 mm. The score is 0 for shut valves and 100 for the best law. One half of the episodes chooses the best law "
    "and the best policy, the other half measures them."
)


def _contestants(environment: str) -> Iterable[tuple[str, str]]:
    """Names and policy folders ("" for a law) of whatever is measured in an environment: of policies, those that were trained
    with sensors of the table."""
    for law in (*UNCONTROLLED, *default_controllers()):
        yield law, ""
    for name in shipped_names():
        if name.partition("_")[0] == policy_of(environment):
            for folder in (one for one in policy_folders(name) if load_policy(one).training["sensors"] in SENSORS):
                yield f"{name} {folder.name}", f"{name}/{folder.name}"


def _task(where: tuple[str, str, bool], controller: str, policy: str, arguments: argparse.Namespace) -> Task:
    environment, sensors, randomize = where
    stem = f"cells/{file_stem(controller)}/{environment.removeprefix('BirthSIM/')}-{sensors}-{RIGS[randomize]}"
    settings = {
        "controller": controller, "policy": policy, "environment": environment, "sensors": sensors, "randomize": randomize,
        "episodes": arguments.episodes, "seed": arguments.seed,
        "network": file_hash(str(SHIPPED / policy / WEIGHTS)) if policy else "",
    }  # fmt: skip
    return Task(stem, "policies" if policy else controller, score_cell, settings)


def score_cell(
    controller: str, policy: str, environment: str, sensors: str, randomize: bool, episodes: int, seed: int, network: str
) -> Result:
    """Figures of one controller in one environment under one condition; ``policy`` is a shipped policy's folder or "", and its
    ``network``'s hash only tells results of different policies apart."""
    rig = Parameters()
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


def _roles(rows: Rows) -> dict[str, dict[str, Any]]:
    """Who plays which of ``ROLES``: the best are chosen by one half of the episodes, all are measured by the other.

    Without policies there is no best one.
    """

    def best(names: Iterable[str]) -> str:
        return max(names, key=lambda name: float(rows[name]["halves"][0]))

    laws = default_controllers()
    learned = [name for name in rows if name not in laws and name not in UNCONTROLLED]
    chosen = ("shut-valves", "random-valves", "backstepping", best(laws), *([best(learned)] if learned else []))
    return {
        role: {
            "controller": name, "return": rows[name]["halves"][1],
            **{key: rows[name][key] for key in ("error", "lost", "success")},
        }
        for role, name in zip(ROLES, chosen, strict=False)
    }  # fmt: skip
