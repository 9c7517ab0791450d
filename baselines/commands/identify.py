"""birthsim identify: a laboratory's own rig from a log, and the experiment that makes such a log."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tqdm import tqdm

from baselines.commands.shared import finite_number, run, seed_number
from baselines.identification.experiment import propose, read_plan
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.identification.log_file import read_trial, write_trial
from baselines.logs.writing import WRITERS
from baselines.registry import make_controller
from baselines.work.files import make_folder, whole_results, write_text
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

DURATION = 12.0
"""s of a proposed experiment; the table of docs/identify.md is made with as much."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim identify",
        description="Estimate friction, mass, valves, dead volume and latency of a rig from a log, with 95 % intervals, and "
        "write the rig as TOML. --propose writes an experiment that tells them, --simulate runs it on the simulator.",
    )
    parser.add_argument(
        "log", nargs="?", type=Path, help=".csv, .parquet or .mcap: time, openings, pressures, positions, forces"
    )
    parser.add_argument("--propose", type=Path, metavar="PLAN", help="write an experiment as CSV: target, and openings to add")
    parser.add_argument("--simulate", type=Path, metavar="PLAN", help="run an experiment on the simulator and write its log")
    parser.add_argument("--out", type=Path, help="the rig, .toml; with --simulate the log, .csv, .parquet or .mcap")
    parser.add_argument("--parameters", help="TOML file of the rig as far as it is known (default: the paper's)")
    parser.add_argument("--report", type=Path, metavar="FOLDER", help="folder for report.md and figures of the residuals")
    parser.add_argument("--duration", type=finite_number, help=f"s of the proposed experiment (default: {DURATION:g})")
    parser.add_argument("--controller", metavar="NAME", help="law of --simulate (default: backstepping)")
    parser.add_argument("--sensors", choices=tuple(SENSORS), help="of --simulate (default: lab)")
    parser.add_argument("--seed", type=seed_number, default=0, help="of what is drawn (default: %(default)s)")
    run(parser, _identify)


def _identify(arguments: argparse.Namespace) -> None:
    asked = [name for name in ("log", "propose", "simulate") if getattr(arguments, name) is not None]
    if len(asked) != 1:
        raise ValueError(f"{' and '.join(asked) or 'nothing'} given; allowed: one of LOG, --propose PLAN, --simulate PLAN")
    for name, needed in (("duration", "propose"), ("controller", "simulate"), ("sensors", "simulate"), ("report", "log")):
        if getattr(arguments, name) is not None and asked != [needed]:
            raise ValueError(f"--{name} is given; allowed with {'LOG' if needed == 'log' else f'--{needed}'} only")
    rig = load_parameters(arguments.parameters)
    {"log": _from_log, "propose": _propose, "simulate": _simulate}[asked[0]](arguments, rig)


def _propose(arguments: argparse.Namespace, rig: Parameters) -> None:
    if arguments.out is not None:
        raise ValueError("--out is given; allowed with LOG or --simulate, --propose names its own file")
    plan = propose(rig, DURATION if arguments.duration is None else arguments.duration, arguments.seed)
    plan.write(arguments.propose)
    print(f"written to {arguments.propose}: {len(plan.times)} rows of time, target and openings to add to a law's")


def _simulate(arguments: argparse.Namespace, rig: Parameters) -> None:
    out = _out(arguments, (".csv", *WRITERS))
    plan = read_plan(arguments.simulate, rig)
    law = make_controller(arguments.controller or "backstepping", rig)
    count = int((plan.times[-1] - plan.times[0]) / rig.electronics.control_period)
    with _bar(count, "experiment", "period") as tick:
        trial = run_plan(plan, [rig], law, arguments.sensors or "lab", arguments.seed, tick)[0]
    write_trial(trial, out, rig)
    print(f"written to {out}: {len(trial.times)} rows, {trial.times[-1] - trial.times[0]:.4g} s")


def _from_log(arguments: argparse.Namespace, owner: Parameters) -> None:
    out = _out(arguments, (".toml",))
    trial = read_trial(arguments.log, owner)
    folder = None if arguments.report is None else make_folder(arguments.report)
    with _bar(None, "fit", "evaluation") as tick:
        found = identify(trial, owner, arguments.seed, tick=tick)
    found.write(out, arguments.log.name)
    print("\n".join(found.words()))
    print(f"written to {out}: {sum(row.told for row in found.rows)} of {len(found.rows)} parameters are from the log")
    if folder is not None:
        # pyplot takes half a second to load.
        from baselines.figures.identification import intervals_figure, residuals_figure

        with whole_results(folder) as place:
            drawn = [*residuals_figure(found, place), *intervals_figure(found, place)]
            pictures = [path.name for path in drawn if path.suffix == ".png"]
            shown = [f"![{name}]({name})" for name in pictures]
            text = [f"# {arguments.log.name}", "", *(f"- {line}" for line in found.words()), "", *shown]
            write_text(place / "report.md", "\n".join(text) + "\n")
        print(f"written to {folder}/: report.md, {', '.join(pictures)} (each picture as .svg too)")


def _out(arguments: argparse.Namespace, suffixes: tuple[str, ...]) -> Path:
    out: Path | None = arguments.out
    if out is None or out.suffix not in suffixes or not out.resolve().parent.is_dir():
        given = "is missing" if out is None else repr(str(out))
        raise ValueError(f"--out {given}; allowed: a file that ends in {', '.join(suffixes)}, in a folder that exists")
    return out


@contextmanager
def _bar(total: int | None, title: str, unit: str) -> Iterator[Callable[[], object]]:
    with tqdm(total=total, desc=title, unit=unit, leave=False) as bar:
        yield bar.update
