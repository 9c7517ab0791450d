"""birthsim study accuracy: the error of the plant's integrator, over a rig and rigs drawn around it."""

from __future__ import annotations

import argparse
from pathlib import Path

from tqdm import tqdm

from baselines.commands.shared import run, seed_number, whole
from baselines.work.files import make_folder, write_json, write_text
from birthsim_env.physics.rig.parameters import load_parameters
from studies.accuracy import errors as accuracy
from studies.accuracy import tables as accuracy_tables
from studies.accuracy.motions import MOTIONS


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim study accuracy",
        description="Measure the plant's error of integration against an independent model with adaptive steps.",
    )
    parser.add_argument("--rigs", type=whole, default=8, help="random corners, and random rigs (default: %(default)s each)")
    parser.add_argument("--seed", type=seed_number, default=0, help="of the rigs (default: %(default)s)")
    parser.add_argument("--parameters", help="TOML file of the nominal rig (default: the paper's)")
    parser.add_argument("--out", type=Path, required=True, help="folder for accuracy.json, the tables and the figure")
    run(parser, _verify)


def _verify(arguments: argparse.Namespace) -> None:
    rigs = accuracy.rigs_to_measure(load_parameters(arguments.parameters), arguments.rigs, arguments.seed)
    from studies.accuracy.figure import accuracy_figure  # pyplot takes half a second to load

    folder = make_folder(arguments.out)
    with tqdm(total=accuracy.runs(len(rigs), len(MOTIONS)), desc="verify", unit=" runs", leave=False) as bar:
        found = accuracy.measure(rigs, MOTIONS, bar.update)
    write_json(folder / "accuracy.json", {"seed": arguments.seed, **found})
    write_text(folder / "accuracy.md", accuracy_tables.tables(found) + "\n")
    accuracy_figure(found, folder)
    print(accuracy_tables.tables(found))
    print(f"\nwritten to {folder}/: accuracy.json, accuracy.md, accuracy.png (the picture as .svg too)")
