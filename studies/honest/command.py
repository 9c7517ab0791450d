"""Laws under the ``honest`` sensors, and what no law can have: the tables of docs/honest.md.

birthsim study honest --controller admittance-adaptive --out out/honest
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from baselines.bench.evaluation import Evaluation, evaluate
from baselines.bench.statistics import number, penalize_lost, quantile
from baselines.commands.shared import EPISODES, run, seed_number, whole_up_to
from baselines.registry import make_controller
from baselines.work.files import make_folder, write_text
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.parts.sensors.sensor_errors import FIGURES
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from studies.comparison.grid import MOVING
from studies.honest.sensor_floor import probe_floor

CONDITIONS = ("ideal", "lab", "honest", "honest, drawn")
"""Sensors; the last ones are drawn from their ranges, and the laws believe in the defaults."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study honest", description=__doc__.splitlines()[0])
    parser.add_argument("--controller", nargs="+", required=True, metavar="NAME", help="laws of the registry")
    parser.add_argument("--episodes", type=whole_up_to(EPISODES), default=128, help="per cell (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=70000, help="of the first episode (default: %(default)s)")
    parser.add_argument("--parameters", help="TOML file of the rig as the laws believe it (default: the paper's)")
    parser.add_argument("--out", type=Path, required=True, help="folder for honest.md")
    run(parser, _honest)


def as_described(rig: Parameters) -> Parameters:
    """``rig`` whose sensors stay as they are described where everything else of it is drawn."""
    board = rig.to_dict()["electronics"]
    ranges = {f"electronics.{name}": [board.get(name, getattr(rig.electronics, name))] * 2 for name in FIGURES}
    return Parameters.from_dict({**rig.to_dict(), "randomize": ranges})


def _honest(arguments: argparse.Namespace) -> None:
    folder, believed = make_folder(arguments.out), load_parameters(arguments.parameters)
    lines = [
        f"Rigs and scenarios drawn, {arguments.episodes} episodes from seed {arguments.seed}; median, 95 % and worst.", "",
        "| law | sensors | Probe: stiffness error, % | hunting, mm | settled error, mm | Circle: settled error, mm | "
        f"{' | '.join(f'Circle, {hand} hand' for hand in MOVING)} | lost |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    span = (arguments.episodes, arguments.seed)
    for name in arguments.controller:
        for condition in CONDITIONS:
            sensors, _, drawn = condition.partition(", ")
            rig = as_described(believed) if sensors == "honest" and not drawn else believed
            probe, *circles = (
                evaluate(environment_id(scenario), make_controller(name, believed), name, *span, sensors=sensors,
                         randomize=True, parameters=rig, user_force=hand)
                for scenario, hand in (("probe", None), ("circle", None), *(("circle", hand) for hand in MOVING))
            )  # fmt: skip
            hunting = np.maximum(sizes_of(probe, "hunting_x"), sizes_of(probe, "hunting_y"))
            settled = [sizes_of(one, "settled_rms") for one in (probe, *circles)]
            figures = (sizes_of(probe, "stiffness_error"), hunting, *settled)
            lost = sum(sum(one.lost) for one in (probe, *circles))
            lines.append(f"| {name} | {condition} | {' | '.join(map(three, figures))} | {lost} |")
            print(lines[-1])
    for condition, rig in (("honest", as_described(believed)), ("honest, drawn", believed)):
        floor = {name: np.abs(values) for name, values in probe_floor(rig, *span).items()}
        lines.append(
            f"| no law can have | {condition} | {three(floor['stiffness_error'])} | | {three(floor['held_error'])}{' |' * 6}"
        )
    write_text(folder / "honest.md", "\n".join(lines) + "\n")
    print("\n".join(lines))


def sizes_of(evaluation: Evaluation, metric: str) -> Array:
    """The sizes of a metric per episode, infinite where the lane was lost."""
    return np.abs(penalize_lost(evaluation.metrics[metric], evaluation.lost, applies=True))


def three(values: Array) -> str:
    """Median, 95 % and worst."""
    return ", ".join(number(quantile(values, fraction)) for fraction in (0.5, 0.95, 1.0))
