"""birthsim-train: a residual policy on the paper's law, by PPO."""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium

import agents
from baselines.commands.shared import RANDOMIZE, make_folder, run, seed_number, whole, write_json
from birthsim_env.parameters import load_parameters


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim-train",
        description="Train a residual policy on top of the paper's law with PPO of Stable-Baselines3.",
        epilog="The best policy on validation worlds is kept in --out whenever it improves; Ctrl-C stops and keeps it.",
    )
    parser.add_argument("--env", default="BirthSIM/CircleResidual-v0", help="residual environment (default: %(default)s)")
    parser.add_argument("--steps", type=whole, default=3_000_000, help="policy steps (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=0)
    parser.add_argument("--sensors", default="ideal", choices=("ideal", "lab"))
    parser.add_argument("--randomize", default="all", choices=tuple(RANDOMIZE), help="what training varies (default: all)")
    parser.add_argument("--authority", type=float, help="bound of the residual force, N (default: 100)")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--out", type=Path, required=True, help="folder for policy.safetensors, policy.json, training.json")
    run(parser, _train)


def _train(arguments: argparse.Namespace) -> None:
    assert agents
    known = sorted(name for name in gymnasium.registry if name.startswith("BirthSIM/") and "Residual" in name)
    if arguments.env not in known:
        raise ValueError(f"--env {arguments.env!r}; allowed: {', '.join(known)}")
    rig = load_parameters(arguments.parameters)
    try:
        # Stable-Baselines3 and torch take three seconds to load and come with the extra "agents" only.
        from agents.residual_law import ResidualSettings
        from agents.training import TrainingSettings, train
    except ImportError as error:
        raise ValueError(f"{error}; training needs the extra: pip install 'birthsim[agents]'") from error
    settings = TrainingSettings(
        environment=arguments.env,
        steps=arguments.steps,
        seed=arguments.seed,
        sensors=arguments.sensors,
        randomize=RANDOMIZE[arguments.randomize],
    )
    residual = ResidualSettings() if arguments.authority is None else ResidualSettings(authority=arguments.authority)
    folder = make_folder(arguments.out)
    reached = train(settings, residual, folder, rig)
    write_json(folder / "training.json", reached)
    law, policy = reached["law"], reached["policy"]
    print(f"\n{settings.environment}, {settings.validation_lanes} validation episodes, settled RMS error:")
    print(f"{'':12}{'pooled':>10}{'95 %':>10}{'lost':>8}")
    for name, figures in (("law", law), ("residual", policy)):
        print(f"{name:12}{figures['pooled_mm']:7.2f} mm{figures['tail_mm']:7.2f} mm{figures['lost']:8d}")
    print(f"{100 * (1 - policy['pooled_mm'] / law['pooled_mm']):.0f} % below the law; written to {folder}/")


if __name__ == "__main__":
    main()
