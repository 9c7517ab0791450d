"""Rigs drawn at random, identified from logs of their own: the table of docs/identify.md.

python -m baselines.commands.identify_recovery --out out/recovery
"""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.shared import JOBS, add_processes, finite_number, run, seed_number, whole_up_to
from baselines.identification.recovery import recovery_table, recovery_tasks
from baselines.work.files import make_folder, write_text
from baselines.work.tasks import run_tasks


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="baselines.commands.identify_recovery", description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=whole_up_to(10_000), default=50, help="default: %(default)s")
    parser.add_argument("--seed", type=seed_number, default=81000, help="of the first rig (default: %(default)s)")
    parser.add_argument("--duration", type=finite_number, default=12.0, help="s of each experiment (default: %(default)s)")
    add_processes(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder for the pieces and recovery.md")
    run(parser, _recover)


def _recover(arguments: argparse.Namespace) -> None:
    folder = make_folder(arguments.out)
    tasks = recovery_tasks(arguments.rigs, arguments.seed, arguments.duration)
    done, failures = run_tasks(tasks, folder, arguments.jobs or JOBS, "rigs", arguments.cluster)
    for name, words in failures.items():
        print(f"{name}: {words}")
    if not done:
        raise ValueError(f"none of {len(tasks)} rigs was identified")
    head = f"{len(done)} of {len(tasks)} rigs, seeds from {arguments.seed}, experiments of {arguments.duration:g} s, `lab` sensors."
    worst = max(max(result["misfit"]) for result in done.values())
    lines = [head, "", *recovery_table(list(done.values())), "", f"Largest residual over the noise of its log: {worst:.3f}."]
    write_text(folder / "recovery.md", "\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
