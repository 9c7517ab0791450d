"""birthsim-evaluate: controllers over seeded episodes, a table, JSON and a figure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gymnasium

import birthsim_env
from baselines.commands.shared import RANDOMIZE, make_folder, run, seed_number, whole, write_json
from baselines.evaluation import Evaluation, evaluate, table
from baselines.registry import controller_names, make_controller


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim-evaluate",
        description="Evaluate controllers on one environment: the same seeds, so the same worlds, for each of them.",
        epilog="Without --policy every named controller runs; with it the trained residual runs beside the law.",
    )
    parser.add_argument("--env", default="BirthSIM/Circle-v0", help="environment id (default: %(default)s)")
    parser.add_argument(
        "--controller",
        nargs="+",
        default=["backstepping"],
        metavar="NAME",
        help=f"one or more of {', '.join(controller_names())}, or path/to/file.py:Class (default: backstepping)",
    )
    parser.add_argument("--policy", type=Path, help="folder of a trained policy, for the controller 'residual'")
    parser.add_argument("--episodes", type=whole, default=32, help="default: %(default)s")
    parser.add_argument("--seed", type=seed_number, default=0, help="seed of the first episode (default: %(default)s)")
    parser.add_argument("--sensors", default="ideal", choices=("ideal", "lab"))
    parser.add_argument(
        "--randomize",
        default="all",
        choices=tuple(RANDOMIZE),
        help="what differs between episodes: the plant, the scenario, both (default) or nothing",
    )
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--out", type=Path, required=True, help="folder for evaluation.json, evaluation.md and figures")
    run(parser, _evaluate)


def _evaluate(arguments: argparse.Namespace) -> None:
    rig = birthsim_env.parameters.load_parameters(arguments.parameters)
    if arguments.env not in [name for name in gymnasium.registry if name.startswith("BirthSIM/")]:
        known = ", ".join(
            sorted(name for name in gymnasium.registry if name.startswith("BirthSIM/") and "Residual" not in name)
        )
        raise ValueError(f"--env {arguments.env!r}; allowed: {known}")
    names = list(arguments.controller)
    if "residual" in names and arguments.policy is None:
        raise ValueError("--controller residual needs --policy DIR, the folder that birthsim-train wrote")
    if arguments.policy is not None:
        names = ["backstepping", "residual"] if names == ["residual"] else list(dict.fromkeys([*names, "residual"]))
    controllers = {}
    for name in names:
        options: dict[str, Any] = {"policy": arguments.policy} if name == "residual" else {}
        controllers[name] = make_controller(name, rig, **options)
    folder = make_folder(arguments.out)
    setting = {"parameters": rig, "sensors": arguments.sensors, "randomize": RANDOMIZE[arguments.randomize]}
    evaluations: list[Evaluation] = []
    for name, controller in controllers.items():
        try:
            evaluations.append(evaluate(arguments.env, controller, name, arguments.episodes, arguments.seed, **setting))
        except KeyboardInterrupt:
            if not evaluations:
                raise
            break
        if len(evaluations[-1].seeds) < arguments.episodes:
            break  # interrupted: what is complete is written, and no further controller is begun
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from baselines.figures import error_over_time

    caption = f"{arguments.env}, {arguments.episodes} episodes from seed {arguments.seed}, {arguments.sensors} sensors, "
    caption += f"randomised: {arguments.randomize}"
    text = table(evaluations)
    (folder / "evaluation.md").write_text(f"{caption}\n\n{text}\n", encoding="utf-8")
    shown = {key: str(value) for key, value in vars(arguments).items()}
    results = [evaluation.to_dict() for evaluation in evaluations]
    write_json(folder / "evaluation.json", {"arguments": shown, "rig": rig.to_dict(), "results": results})
    error_over_time(evaluations, caption, folder)
    print(f"{caption}\n\n{text}\n\nwritten to {folder}/: evaluation.json, evaluation.md, error_over_time.png and .svg")


if __name__ == "__main__":
    main()
