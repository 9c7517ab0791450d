"""``birthsim run``: one episode of one controller, its error over time printed, its motion drawn."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from tqdm import tqdm

from baselines.commands.parts import add_parts, add_set, environment_parts, with_options
from baselines.commands.shared import RANDOMIZE, check_environment, policy_of, run, seed_number
from baselines.registry import controller_names, make_controller
from baselines.staged import NO_ACTION, driving
from baselines.work.files import make_folder, whole_results
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import load_parameters

FIELDS = ("time", "position", "compliant_target", "tracking_error", "user_force")
"""What is kept of ``info``: s, m, m, m, N."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim run", description="Run one episode, print its error second by second, draw its motion."
    )
    parser.add_argument("--env", default="BirthSIM/Circle-v1", help="environment id (default: %(default)s)")
    parser.add_argument(
        "--controller", default="admittance", metavar="NAME",
        help=f"one of {', '.join(controller_names())}, or path/to/file.py:Class (default: %(default)s)",
    )  # fmt: skip
    add_set(parser)
    add_parts(parser)
    parser.add_argument("--seed", type=seed_number, default=0, help="of the episode (default: %(default)s)")
    parser.add_argument("--sensors", choices=tuple(SENSORS), default="ideal", help="default: %(default)s")
    parser.add_argument("--randomize", choices=tuple(RANDOMIZE), default="none", help="default: %(default)s")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--out", type=Path, required=True, help="folder for episode.png and .svg")
    run(parser, _run)


def _run(arguments: argparse.Namespace) -> None:
    rig = load_parameters(arguments.parameters)
    check_environment(arguments.env)
    name = with_options([arguments.controller], arguments.set)[0]
    law = driving(make_controller(name, rig, **({"policy": policy_of(arguments.env)} if name == "residual" else {})), name)
    env = gymnasium.make(
        arguments.env, parameters=rig, sensors=arguments.sensors, randomize=RANDOMIZE[arguments.randomize],
        policy_period=rig.electronics.control_period, actuation=law, **environment_parts(arguments),
    )  # fmt: skip
    folder = make_folder(arguments.out)
    print(described(rig, RANDOMIZE[arguments.randomize], arguments.sensors))
    episode, lost = record(env, arguments.seed)
    # pyplot takes half a second to load.
    from baselines.figures.episode import episode_figure

    title = f"{arguments.env}, {name}, seed {arguments.seed}, {arguments.sensors} sensors"
    with whole_results(folder) as place:
        episode_figure(episode, title, place)
    print("\n".join([title, "", *table(episode)]))
    if lost:
        print(f"\nlost after {episode['time'][-1]:.2f} s: a piston ran into its stop, or a chamber left its range")
    print(f"\nwritten to {folder}/: episode.png, episode.svg")


def record(env: Any, seed: int) -> tuple[dict[str, Array], bool]:
    """``FIELDS`` of every control period of an episode, a row each, and whether it ended before its time."""
    _, info = env.reset(seed=seed)
    rows: dict[str, list[Any]] = {name: [np.copy(info[name])] for name in FIELDS}
    terminated = truncated = False
    with tqdm(total=env.get_wrapper_attr("duration"), desc="episode", unit=" s", leave=False) as bar:
        while not (terminated or truncated):
            _, _, terminated, truncated, info = env.step(NO_ACTION)
            for name, kept in rows.items():
                kept.append(np.copy(info[name]))
            if len(rows["time"]) % 500 == 0:
                bar.update(float(info["time"]) - bar.n)
    env.close()
    return {name: np.array(kept) for name, kept in rows.items()}, bool(terminated)


def table(episode: dict[str, Array]) -> list[str]:
    """The hand's force and the error of every second, and of the whole episode."""
    size, force = 1e3 * np.linalg.norm(episode["tracking_error"], axis=1), np.linalg.norm(episode["user_force"], axis=1)
    lines = [f"{'s':>9}{'hand, at most N':>18}{'error, RMS mm':>16}{'at most mm':>13}"]
    seconds = np.floor(episode["time"])
    chosen = [(f"{second:.0f} to {second + 1:.0f}", seconds == second) for second in np.unique(seconds)]
    for label, rows in [*chosen, ("all", np.ones(len(size), bool))]:
        if rows.sum() > 1:
            rms = np.sqrt(np.mean(np.square(size[rows])))
            lines.append(f"{label:>9}{force[rows].max():18.1f}{rms:16.3f}{size[rows].max():13.3f}")
    return lines
