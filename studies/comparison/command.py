"""birthsim study comparison: every controller under all conditions, and how the stiffness feels."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.bench.statistics import jsonable
from baselines.commands.parts import add_set, with_options
from baselines.commands.shared import EPISODES, JOBS, add_processes, run, seed_number, shown_arguments, whole_up_to
from baselines.registry import CONTROLLERS, SLOW, bare_name
from baselines.work.files import make_folder, own_folder, whole_results, write_json, write_text
from baselines.work.tasks import Result, code_stamp, run_tasks
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from studies.comparison import grid as comparison
from studies.comparison.grid import Conditions, all_conditions, cell_task, default_controllers
from studies.comparison.stiffness import study_tasks
from studies.comparison.tables import data, losses, overview

NARROWED = {"scenario": "nominal", "all": "randomised", "sensors": "drawn-sensors"}
"""The option --randomize -> the one plant that is then compared."""

_FIGURES = (
    "Every figure, with its interval, its worst episode and its ratio to the paper's law: [comparison.csv](comparison.csv)"
)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim study comparison",
        description="Compare controllers in every environment, with every sensor model, on the rig as given and on rigs "
        "drawn at random, and how their stiffness feels. --env, --sensors and --randomize narrow it. What the output folder "
        "holds of the same settings, rig and code is kept, so that an interrupted run goes on.",
    )
    parser.add_argument("--env", help="environment id (default: every one)")
    parser.add_argument(
        "--controller", nargs="+", metavar="NAME", help="registered names, with options, or path/to/file.py:Class (default: "
        "every one that is not slow)",
    )  # fmt: skip
    parser.add_argument("--episodes", type=whole_up_to(EPISODES), default=32, help="per cell (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=0, help="seed of the first episode (default: %(default)s)")
    parser.add_argument("--sensors", choices=tuple(SENSORS), help="default: ideal and lab")
    parser.add_argument(
        "--randomize",
        choices=tuple(NARROWED),
        help="default: the scenario, then both, then figures of sensors",
    )
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    add_set(parser)
    add_processes(parser)
    parts = parser.add_mutually_exclusive_group()
    parts.add_argument("--no-studies", action="store_true", help="leave out how the stiffness feels")
    parts.add_argument("--studies-only", action="store_true", help="nothing but how the stiffness feels, some minutes")
    parser.add_argument("--out", type=Path, required=True, help="folder for comparison.json, .csv, .md and figures")
    run(parser, _compare)


def _compare(arguments: argparse.Namespace) -> None:
    """Run what ``--out`` does not hold yet, and write comparison.json, .csv, .md and the figures."""
    rig = load_parameters(arguments.parameters)
    names = list(dict.fromkeys(arguments.controller or default_controllers()))
    names = with_options(names, arguments.set)
    for name in names:
        plain = bare_name(name)
        if plain not in CONTROLLERS and not plain.rpartition(":")[0].endswith(".py"):
            raise ValueError(f"--controller {name!r}; allowed: {', '.join(CONTROLLERS)}, or path/to/file.py:Class")
    settings = [controller_settings(name, rig) for name in names]
    conditions = [] if arguments.studies_only else _conditions(arguments)
    folder, jobs = make_folder(arguments.out), arguments.jobs or JOBS
    cells = {
        (own["controller"], where): cell_task(own, where, arguments.episodes, arguments.seed)
        for own in settings for where in conditions
    }  # fmt: skip
    quick = [own for own in settings if bare_name(own["controller"]) not in SLOW]
    studies = {} if arguments.no_studies else study_tasks(quick, rig)
    print(described(rig, True))
    with own_folder(folder):
        done, problems = run_tasks([*cells.values(), *studies.values()], folder, jobs, "comparison", arguments.cluster)
    gathered = comparison.gather({key: done[task.name] for key, task in cells.items() if task.name in done})
    found = {key: done[task.name] for key, task in studies.items() if task.name in done}
    with whole_results(folder) as place:
        written = _write(arguments, rig, gathered, found, place)
    print(f"written to {folder}/: {', '.join(written)} (each picture as .svg too)")
    if problems:
        name, problem = next(iter(problems.items()))
        raise ValueError(f"{len(problems)} of {len(cells) + len(studies)} pieces failed, the first {name}: {problem}")


def _conditions(arguments: argparse.Namespace) -> list[Conditions]:
    """All of them, less what --env, --sensors and --randomize leave out."""
    narrowed: dict[str, Any] = {}
    if arguments.env is not None:
        if arguments.env not in comparison.ENVIRONMENTS:
            raise ValueError(f"--env {arguments.env!r}; allowed: {', '.join(comparison.ENVIRONMENTS)}")
        narrowed["environments"] = (arguments.env,)
    if arguments.sensors is not None:
        narrowed["sensors"] = (arguments.sensors,)
    if arguments.randomize is not None:
        narrowed["plants"] = (NARROWED[arguments.randomize],)
    conditions = all_conditions(**narrowed)
    if not conditions:
        raise ValueError("--randomize 'sensors'; allowed: with --sensors honest, whose figures can be drawn")
    return conditions


def _write(
    arguments: argparse.Namespace, rig: Parameters, cells: comparison.Cells, studies: dict[tuple[str, str], Result],
    folder: Path,
) -> list[str]:  # fmt: skip
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from studies.comparison.figure import draw_comparison
    from studies.comparison.stiffness_figures import draw_studies

    figures = comparison.statistics(cells)
    by_study: dict[str, dict[str, Result]] = {}
    for (study, label), result in studies.items():
        by_study.setdefault(study, {})[label] = result
    content = {
        "arguments": shown_arguments(arguments), "code": code_stamp("studies.comparison.grid"), "rig": rig.to_dict(),
        "units": comparison.METRICS,
        "cells": jsonable(figures), "studies": by_study,
    }  # fmt: skip
    write_json(folder / "comparison.json", content)
    # The only file that differs from run to run.
    write_json(folder / "times.json", {"us_per_lane_and_call": comparison.costs(cells)})
    files = ["comparison.json", "times.json"]
    if not arguments.studies_only:
        several = len({cell["environment"] for cell in figures}) > 1
        text = "\n\n".join([overview(figures), *([losses(figures)] if several else [])])
        caption = (
            f"{arguments.episodes} episodes per cell from seed {arguments.seed}, the same worlds for every controller. Medians "
            f"with 95 % bootstrap intervals; a lost episode counts as infinitely bad."
        )
        write_text(folder / "comparison.csv", data(figures))
        write_text(folder / "comparison.md", f"# Comparison\n\n{caption}\n\n{text}\n\n{_FIGURES}\n")
        print(f"{caption}\n\n{text}\n")
        files += ["comparison.csv", "comparison.md"]
    drawn = [*draw_comparison(figures, folder), *draw_studies(by_study, folder)]
    return files + sorted({path.stem + ".png" for path in drawn})
