"""Rigs drawn at random, identified from logs of their own: the table of docs/identify.md.

birthsim study recovery --out out/recovery
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.statistics import quantile
from baselines.commands.shared import JOBS, add_processes, finite_number, run, seed_number, whole_up_to
from baselines.identification.quantities import QUANTITIES
from baselines.work.files import make_folder, own_folder, write_text
from baselines.work.tasks import run_tasks
from birthsim_env.physics.rig.parameters import field_of
from studies.recovery.tasks import EXPERIMENTS, RANGES, recovery_tasks


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study recovery", description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=whole_up_to(10_000), default=50, help="default: %(default)s")
    parser.add_argument("--seed", type=seed_number, default=82000, help="of the first rig (default: %(default)s)")
    parser.add_argument("--duration", type=finite_number, default=12.0, help="s of each experiment (default: %(default)s)")
    parser.add_argument("--experiment", choices=tuple(EXPERIMENTS), default="proposed", help="default: %(default)s")
    add_processes(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder for the pieces and EXPERIMENT.md")
    run(parser, _recover)


def _recover(arguments: argparse.Namespace) -> None:
    folder = make_folder(arguments.out)
    tasks = recovery_tasks(arguments.rigs, arguments.seed, arguments.duration, arguments.experiment)
    with own_folder(folder):
        done, failures = run_tasks(tasks, folder, arguments.jobs or JOBS, "rigs", arguments.cluster)
    for name, words in failures.items():
        print(f"{name}: {words}")
    if not done:
        raise ValueError(f"none of {len(tasks)} rigs was identified")
    words = f"seeds from {arguments.seed}, experiment {arguments.experiment} of {arguments.duration:g} s, `lab` sensors"
    head = f"{len(done)} of {len(tasks)} rigs, {words}."
    worst = max(max(result["misfit"]) for result in done.values())
    lines = [head, "", *recovery_table(list(done.values())), "", f"Largest residual over the noise of its log: {worst:.3f}."]
    write_text(folder / f"{arguments.experiment}.md", "\n".join(lines) + "\n")
    print("\n".join(lines))


def recovery_table(results: list[dict[str, Any]]) -> list[str]:
    """Markdown: per parameter how many rigs' logs tell it, and of these error and interval."""
    lines = [
        "| parameter | drawn from | told in | error: median | 95 % | largest | half interval: median | true value inside |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in QUANTITIES:
        rows = [result["rows"][one.name] for result in results]
        told = [row for row in rows if row["told"]]
        low, high = RANGES[one.name]
        scale, unit, digits = (1e3, "ms", 2) if one.unit else (100.0, "%", 2)
        errors = [scale * abs(row["value"] - row["true"]) / (1.0 if one.unit else row["true"]) for row in told]
        halves = [scale * 0.5 * (row["high"] - row["low"]) / (1.0 if one.unit else row["true"]) for row in told]
        cells = [quantile(np.array(errors), f) for f in (0.5, 0.95, 1.0)] + [quantile(np.array(halves), 0.5)]
        inside = sum(row["low"] <= row["true"] <= row["high"] for row in told)
        written = " | ".join(f"{cell:.{digits}g} {unit}" for cell in cells)
        ranges = f"{low:g} to {high:g} {field_of(one.name).metadata['unit']}"
        lines.append(f"| `{one.name}` | {ranges} | {len(told)} of {len(rows)} | {written} | {inside} of {len(told)} |")
    return lines
