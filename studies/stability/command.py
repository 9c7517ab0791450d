"""birthsim study stability: where a controller is stable, over rigs that are not as believed and over hands that hold it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.commands.parts import add_set, with_options
from baselines.commands.shared import JOBS, add_processes, run, seed_number, whole_up_to
from baselines.work.files import make_folder, own_folder, whole_results, write_json
from baselines.work.tasks import run_tasks
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters
from studies.stability import maps as stability
from studies.stability.maps import MAPS, describe_map, stability_tasks


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim study stability",
        description="Push rigs that are not as the controller believes, and hands that hold them, and map what comes to rest.",
    )
    parser.add_argument(
        "--controller",
        default="admittance-backstepping",
        metavar="NAME",
        help="a name, or path/to/file.py:Class (default: %(default)s)",
    )
    parser.add_argument("--sensors", default="ideal", choices=tuple(SENSORS), help="default: %(default)s")
    parser.add_argument("--map", action="append", choices=tuple(MAPS), help="may be repeated (default: all)")
    parser.add_argument(
        "--points", type=whole_up_to(200), help="values along each axis, at most 200 (default: those of the map)"
    )
    parser.add_argument("--seed", type=seed_number, default=0, help="of the sensors' noise (default: %(default)s)")
    parser.add_argument("--parameters", help="TOML file of the rig as the controller believes it (default: the paper's)")
    add_set(parser)
    add_processes(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder for stability.json and the figures")
    run(parser, _stability)


def _stability(arguments: argparse.Namespace) -> None:
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    rig, name = load_parameters(arguments.parameters), with_options([arguments.controller], arguments.set)[0]
    settings = controller_settings(name, rig)
    from studies.stability.figure import stability_figure

    folder, chosen = make_folder(arguments.out), list(dict.fromkeys(arguments.map or MAPS))
    tasks = stability_tasks(chosen, settings, arguments.sensors, arguments.points, arguments.seed)
    with own_folder(folder):
        done, failures = run_tasks(list(tasks.values()), folder, arguments.jobs or JOBS, "stability", arguments.cluster)
    if failures:
        raise ValueError(f"{len(failures)} of {len(tasks)} pieces failed, the first: {next(iter(failures.values()))}")
    charts = {
        key: {**describe_map(key, rig, arguments.points), "variants": {
            label: done[task.name] for (place, label), task in tasks.items() if place == key
        }} for key in chosen
    }  # fmt: skip
    setting: dict[str, Any] = {
        "controller": name, "sensors": arguments.sensors, "seed": arguments.seed, "believed": rig.to_dict(),
        "limits": {"motion_mm": 1e3 * stability.MOST_MOTION, "force_of_the_hand_n": stability.MOST_FORCE},
    }  # fmt: skip
    heading = f"{name}, {arguments.sensors} sensors"
    with whole_results(folder) as place:
        write_json(place / "stability.json", {**setting, "maps": charts})
        drawn = [path for key in chosen for path in stability_figure(key, charts[key], heading, place)]
    print(f"{heading}: stable up to and including, from the left of the map\n")
    for chart in charts.values():
        print(_table(chart))
    pictures = ", ".join(path.name for path in drawn if path.suffix == ".png")
    print(f"written to {folder}/: stability.json, {pictures} (each picture as .svg too)")


def _table(chart: dict[str, Any]) -> str:
    """Per value of y and variant how far along x all is stable."""
    labels = list(chart["variants"])
    limits = [stability.stable_up_to(chart, label) for label in labels]
    last = chart["x"]["values"][-1]
    lines = [f"{chart['title']}: {chart['x']['label']}", f"{chart['y']['label']:>40}" + "".join(f"{x:>32}" for x in labels)]
    for k, value in enumerate(chart["y"]["values"]):
        cells = [_limit(row[k], last) for row in limits]
        lines.append(f"{_number(value):>40}" + "".join(f"{cell:>32}" for cell in cells))
    return "\n".join([*lines, ""])


def _limit(value: float | None, last: float) -> str:
    return "nowhere" if value is None else _number(value) + (" (all)" if value == last else "")


def _number(value: float) -> str:
    """Four digits, without an exponent."""
    return f"{value:.0f}" if value >= 1000 else f"{value:.4g}"
