"""birthsim train: residual policies by reinforcement learning, several seeds in one command."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium

from agents.residual.settings import IMPEDANCES, LAWS, ResidualSettings
from agents.training.configuration import ALGORITHMS, TrainingSettings, configuration_names, load_configuration, override
from agents.training.time_split import told
from baselines.commands.settings import RANDOMIZE
from baselines.commands.shared import run, seed_number, whole
from baselines.commands.worlds import check_world
from baselines.work.files import make_folder, own_folder, write_json
from baselines.work.side_by_side import side_by_side
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import Parameters, load_parameters


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim train",
        description="Train residual policies on top of a control law, by PPO, SAC or TQC.",
        epilog="Options override what the configuration says, and have its values by default. The best policy on validation "
        "worlds is kept whenever it improves, and a checkpoint at every validation: after Ctrl-C or a kill the same command "
        "goes on, and ends with the same policy.",
    )
    listed = ", ".join(configuration_names())
    parser.add_argument("--config", default="circle", help=f"{listed}, or a TOML file (default: %(default)s)")
    parser.add_argument("--env", help="residual environment")
    parser.add_argument("--algorithm", choices=ALGORITHMS, help="how it learns")
    laws = f"law underneath, one of {', '.join(LAWS)}; {LAWS[-1]}: the policy drives the valves by itself"
    parser.add_argument("--law", metavar="NAME", help=laws)
    parser.add_argument("--impedance", choices=tuple(IMPEDANCES), help="what an action sets beside forces")
    parser.add_argument("--steps", type=whole, help="policy steps per seed")
    parser.add_argument(
        "--until", type=float, metavar="PERCENT", help="end once the error in validation is so far below the paper's law"
    )
    parser.add_argument("--seed", type=seed_number, help="first seed (default: the configuration's, 0)")
    parser.add_argument("--seeds", type=whole, default=1, help="how many, one after the other from --seed on (default: 1)")
    parser.add_argument("--jobs", type=whole, default=1, help="seeds trained side by side (default: 1)")
    parser.add_argument("--sensors", choices=tuple(SENSORS), help="sensor model")
    parser.add_argument("--randomize", choices=tuple(RANDOMIZE), help="what training varies")
    parser.add_argument("--authority", type=float, help="bound of the residual force, N")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder; each seed has one in it with its policy, checkpoint, curve and events"
    )
    run(parser, _train)


def _train(arguments: argparse.Namespace) -> None:
    training, residual = _settings(arguments)
    known = sorted(name for name in gymnasium.registry if name.startswith("BirthSIM/") and "Residual" in name)
    if training.environment not in known:
        raise ValueError(f"--env {training.environment!r}; allowed: {', '.join(known)}")
    rig = load_parameters(arguments.parameters)
    check_world(training.environment, parameters=rig, randomize=training.randomize, sensors=training.sensors)
    first = training.seed if arguments.seed is None else arguments.seed
    seeds = range(first, first + arguments.seeds)
    make_folder(arguments.out)
    work = [
        (replace(training, seed=seed), residual, arguments.out / f"seed_{seed}", rig, k % arguments.jobs)
        for k, seed in enumerate(seeds)
    ]
    print(described(rig, training.randomize, training.sensors))
    results: dict[int, dict[str, Any]] = {}
    try:
        side_by_side(_one, work, arguments.jobs, results.__setitem__)
    except BaseException:
        if arguments.jobs > 1:
            print(file=sys.stderr)  # the bar of a process that has been ended has no end of line
        raise
    _report(training, residual, list(seeds), [results[k] for k in range(len(work))])
    print(f"written to {arguments.out}/")


def _settings(arguments: argparse.Namespace) -> tuple[TrainingSettings, ResidualSettings]:
    """The configuration, with what the options say instead."""
    training, residual = load_configuration(arguments.config)
    said = {
        "environment": arguments.env, "algorithm": arguments.algorithm, "steps": arguments.steps, "sensors": arguments.sensors,
        "until": arguments.until, "randomize": None if arguments.randomize is None else RANDOMIZE[arguments.randomize],
    }  # fmt: skip
    allowed = {"law": arguments.law, "impedance": arguments.impedance, "authority": arguments.authority}
    return (
        override(training, **{name: value for name, value in said.items() if value is not None}),
        override(residual, **{name: value for name, value in allowed.items() if value is not None}),
    )


def _one(
    settings: TrainingSettings, residual: ResidualSettings, folder: Path, rig: Parameters, position: int
) -> dict[str, Any]:
    try:
        # Stable-Baselines3 and torch take three seconds to load and come with the extra "agents" only.
        from agents.training.trainer import train
    except ImportError as error:
        raise ValueError(f"{error}; training needs the extra: pip install 'birthsim[agents]'") from error
    with own_folder(folder):
        reached = train(settings, residual, folder, rig, position)
        write_json(folder / "training.json", reached)
    return reached


def _report(
    training: TrainingSettings, residual: ResidualSettings, seeds: list[int], results: list[dict[str, Any]]
) -> None:  # fmt: skip
    law, paper = results[0]["law"], results[0]["paper"]
    print(
        f"\n{training.environment}, {training.validation_lanes} validation episodes, of which {law['infeasible']} ask for more"
    )
    print("than the rig's strength and are left out; settled RMS error:")
    print(f"{'':26}{'pooled':>10}{'95 %':>10}{'lost':>8}")
    measure = paper or law
    for name, figures in (
        *((("the paper's law", paper),) if paper else ()),
        *(((residual.law, law),) if not paper or residual.law != LAWS[0] else ()),
        *((f"seed {seed}", result["policy"]) for seed, result in zip(seeds, results, strict=True)),
    ):
        better = "" if figures in (law, paper) else f"  {100 * (1 - figures['pooled_mm'] / measure['pooled_mm']):3.0f} % below"
        print(f"{name:26}{figures['pooled_mm']:7.2f} mm{figures['tail_mm']:7.2f} mm{figures['lost']:8d}{better}")
    last = [result["curve"][-1] for result in results]
    print(", ".join(f"{point['steps']:,}" for point in last), f"of {training.steps:,} steps;", end=" ")
    seconds = ", ".join(f"{point['seconds']:.0f}" for point in last)
    print(f"{seconds} s per seed with validation; of the rest")
    for seed, result in zip(seeds, results, strict=True):
        print(f"seed {seed}: {told(result['curve'][-1]['split'], result['curve'][-1]['environment_fraction'])}")
