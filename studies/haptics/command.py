"""birthsim study haptics: what a hand feels at the end effector (docs/haptics.md)."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.commands.parts import add_set, with_options
from baselines.commands.shared import JOBS, add_processes, run, seed_number, shown_arguments, whole_up_to
from baselines.work.files import finite, make_folder, own_folder, whole_results, write_json, write_text
from baselines.work.tasks import run_tasks
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters
from studies.haptics.measurements import SUBJECTS, Key, gathered, haptic_tasks
from studies.haptics.tables import page_with, report

LAWS = ("backstepping", "backstepping-cartesian", "admittance-backstepping", "pid")
"""What is measured where no controller is named: the paper's law, its Cartesian form, the best law and a rival."""

SEED, RIGS = 4_100_000, 4
"""First seed, of worlds on which nothing was tuned or decided, and number of rigs drawn."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim study haptics",
        description="Measure what a hand feels: impedance, own error, energy, stability, friction and the release of a pull.",
    )
    parser.add_argument(
        "--controller", nargs="+", default=list(LAWS), metavar="NAME",
        help="names, or path/to/file.py:Class (default: " + " ".join(LAWS) + ")",
    )  # fmt: skip
    parser.add_argument("--sensors", action="append", choices=tuple(SENSORS), help="may be repeated (default: ideal and lab)")
    parser.add_argument("--subject", action="append", choices=SUBJECTS, metavar="NAME", help="may be repeated (default: all)")
    parser.add_argument("--rigs", type=whole_up_to(1000), default=RIGS, help="rigs drawn at random (default: %(default)s)")
    parser.add_argument("--nominal", action="store_true", help="the rig as the laws believe it, instead of rigs drawn")
    parser.add_argument("--no-force-sensor", action="store_true", help="show the laws a hand's force of zero")
    parser.add_argument("--seed", type=seed_number, default=SEED, help="of the first rig and sensors (default: %(default)s)")
    parser.add_argument("--parameters", help="TOML file of the rig as the laws believe it (default: the paper's)")
    parser.add_argument("--page", type=Path, help="Markdown page whose marked tables are replaced, such as docs/haptics.md")
    add_set(parser)
    add_processes(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder for haptics.json, haptics.md and the figures")
    run(parser, _haptics)


def _haptics(arguments: argparse.Namespace) -> None:
    rig = load_parameters(arguments.parameters)
    names = list(dict.fromkeys(with_options(arguments.controller, arguments.set)))
    sensors = list(dict.fromkeys(arguments.sensors or ("ideal", "lab")))
    subjects = list(dict.fromkeys(arguments.subject or SUBJECTS))
    rigs = 0 if arguments.nominal else arguments.rigs
    keys = [
        Key(controller_settings(name, rig), kind, arguments.seed, rigs, not arguments.no_force_sensor)
        for name in names for kind in sensors
    ]  # fmt: skip
    page = arguments.page and arguments.page.read_text(encoding="utf-8")
    if page is not None:
        page_with(page, "")  # says at once what is wrong with it
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from studies.haptics.figures import haptic_figures

    folder = make_folder(arguments.out)
    tasks = [haptic_tasks(key, subjects) for key in keys]
    pieces = [task for each in tasks for group in each.values() for task in group]
    with own_folder(folder):
        done, failures = run_tasks(pieces, folder, arguments.jobs or JOBS, "haptics", arguments.cluster)
    if failures:
        raise ValueError(f"{len(failures)} of {len(pieces)} pieces failed, the first: {next(iter(failures.values()))}")
    runs: list[dict[str, Any]] = [gathered(key, each, done) for key, each in zip(keys, tasks, strict=True)]
    text = report(runs)
    with whole_results(folder) as place:
        write_json(place / "haptics.json", finite({"arguments": shown_arguments(arguments), "runs": runs}))
        write_text(place / "haptics.md", text)
        drawn = haptic_figures(runs, place)
    if page is not None:
        write_text(arguments.page, page_with(page, text))
    print(text)
    pictures = ", ".join(path.name for path in drawn if path.suffix == ".png")
    print(f"written to {folder}/: haptics.json, haptics.md, {pictures} (each picture as .svg too)")
