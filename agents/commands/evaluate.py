"""birthsim evaluate: controllers over seeded episodes, tables, JSON and figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gymnasium

from agents.residual.settings import NO_LAW
from baselines.bench.evaluation import merged, overview, table
from baselines.bench.evaluation_data import data
from baselines.bench.pieces import controller_settings, evaluate_piece, evaluation_tasks, file_hash, gathered
from baselines.commands.parts import add_parts, add_set, environment_parts, with_options
from baselines.commands.shared import (
    EPISODES,
    JOBS,
    RANDOMIZE,
    add_processes,
    check_environment,
    check_world,
    policy_of,
    run,
    seed_number,
    shown_arguments,
    whole_up_to,
)
from baselines.registry import controller_names
from baselines.work.files import make_folder, own_folder, whole_results, write_json, write_text
from baselines.work.tasks import Result, run_tasks
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim evaluate",
        description="Evaluate controllers: the same seeds, so the same worlds, for each of them.",
        epilog="Without --policy every named controller runs; with it the trained residual runs beside those named, or else "
        "beside the paper's law and the one that it sits on. What the output folder holds of the same settings, rig and "
        "code is kept, so that an interrupted run goes on.",
    )
    parser.add_argument("--env", default="BirthSIM/Circle-v1", help="environment id (default: %(default)s)")
    parser.add_argument(
        "--controller",
        "--controllers",
        nargs="+",
        metavar="NAME",
        help=f"one or more of {', '.join(controller_names())}, with options as in 'admittance[learn=false]', or "
        "path/to/file.py:Class (default: backstepping, with --policy "
        "residual)",
    )
    parser.add_argument(
        "--policy",
        help="for the controller 'residual': a folder that birthsim train wrote, of one training seed or of several, or the "
        "name of what comes with the package, such as circle (default: that of the scenario)",
    )
    parser.add_argument("--episodes", type=whole_up_to(EPISODES), default=32, help="per controller (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=0, help="seed of the first episode (default: %(default)s)")
    parser.add_argument("--sensors", choices=tuple(SENSORS), default="ideal", help="default: %(default)s")
    parser.add_argument(
        "--randomize",
        choices=tuple(RANDOMIZE),
        default="all",
        help="what differs between episodes: the plant, the scenario, both (default) or nothing; sensors: the scenario and the "
        "figures of honest sensors",
    )
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    add_parts(parser)
    add_set(parser)
    add_processes(parser)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="folder for evaluation.json, .md and .csv, and figures",
    )
    run(parser, _evaluate)


def _evaluate(arguments: argparse.Namespace) -> None:
    arguments.controller = arguments.controller or (["backstepping"] if arguments.policy is None else ["residual"])
    rig = load_parameters(arguments.parameters)
    if not (arguments.env.startswith("BirthSIM/") and arguments.env in gymnasium.registry):  # one with a law inside may be
        check_environment(arguments.env)
    names = list(arguments.controller)
    if "residual" in names and arguments.policy is None:
        arguments.policy = policy_of(arguments.env)
    policies, laws, learned_with = _policies(arguments.policy)
    if policies:
        names = ["backstepping", *laws] if names == ["residual"] else names
        names = list(dict.fromkeys([*names, "residual"]))
    names = with_options([name for name in names if name != "residual"], arguments.set)
    world = {
        "sensors": arguments.sensors, "randomize": RANDOMIZE[arguments.randomize], **environment_parts(arguments),
    }  # fmt: skip
    span = arguments.episodes, arguments.seed
    pieces = {name: evaluation_tasks(name, controller_settings(name, rig), arguments.env, world, *span) for name in names}
    check_world(arguments.env, parameters=rig, **world)  # which compiles: names are looked at before
    known = len(pieces)
    if policies:
        from agents.policy.files import WEIGHTS
    for place in policies:
        name = "residual" if len(policies) == 1 else f"residual {place.name}"
        # The code of policies counts, which lies here; a policy that has been trained anew is another one.
        own = {
            "controller": "residual", "source": file_hash(str(place / WEIGHTS)), "rig": rig.to_dict(), "policy": str(place),
        }  # fmt: skip
        pieces[name] = evaluation_tasks(name, own, arguments.env, world, *span, work=evaluate_learned)
    folder, drawn = make_folder(arguments.out), described(rig, world["randomize"], world["sensors"])
    print(drawn)
    if learned_with - {arguments.sensors}:
        print(f"the policy was trained with {', '.join(sorted(learned_with))} sensors; here they are {arguments.sensors}")
    jobs = arguments.jobs or JOBS
    every = [task for tasks in pieces.values() for task in tasks]
    with own_folder(folder):
        done, failures = run_tasks(every, folder, jobs, "episodes", arguments.cluster)
    if failures:
        name, problem = next(iter(failures.items()))
        raise ValueError(f"{len(failures)} pieces failed, the first {name}: {problem}; what is complete is kept")
    evaluations = [gathered(name, [done[task.name] for task in tasks]) for name, tasks in pieces.items()]
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from baselines.figures.runs import error_over_time

    caption = f"{arguments.env}, {arguments.episodes} episodes from seed {arguments.seed}, {arguments.sensors} sensors, "
    caption += f"--randomize {arguments.randomize}"
    caption += "".join(f", {name.replace('_', ' ')}: {part}" for name, part in environment_parts(arguments).items())
    classical, learned = evaluations[:known], evaluations[known:]
    seeds, pictures = "", "error_over_time"
    if len(learned) > 1:
        from agents.policy.seeds import seed_table
        from agents.reports.learning_curves import draw_learning_curves, learning_curves

        together = merged(learned, f"residual, {len(learned)} seeds")
        evaluations = [*classical, together]
        seeds = "".join(f"\n{seed_table(one, learned)}\n" for one in classical)
        pictures += ", learning_curves"
    lines = [caption, "", overview(evaluations)]
    results = [evaluation.to_dict() for evaluation in (*classical, *learned)]
    with whole_results(folder) as place:
        write_text(place / "evaluation.csv", data(evaluations))
        write_text(place / "evaluation.md", f"{caption}\n\n{drawn}\n\n{table(evaluations)}\n{seeds}")
        write_json(
            place / "evaluation.json", {"arguments": shown_arguments(arguments), "rig": rig.to_dict(), "results": results}
        )
        # The only file that differs from run to run.
        write_json(place / "times.json", {"us_per_lane_and_call": {one.controller: one.cost for one in evaluations}})
        error_over_time(evaluations, caption, place)
        if seeds:
            write_text(place / "seeds.md", f"{caption}\n{seeds}")
            draw_learning_curves(learning_curves(policies), place)
    print("\n".join(lines))
    print(
        f"\nwritten to {folder}/: evaluation.md and .csv (every metric), evaluation.json, times.json, {pictures} (.png, .svg)"
    )


def evaluate_learned(**settings: Any) -> Result:
    """A piece of a residual policy's evaluation."""
    return evaluate_piece(**settings)


def _policies(path: str | None) -> tuple[list[Path], list[str], set[str]]:
    """The policy folders at ``path``, the laws that those policies sit on, and the sensors that they were trained with."""
    if path is None:
        return [], [], set()
    try:
        from agents.policy.files import load_policy
        from agents.policy.seeds import policy_folders
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: pip install 'birthsim[agents]'") from error
    folders = policy_folders(path)
    policies = [load_policy(folder) for folder in folders]
    laws = dict.fromkeys(policy.settings.law for policy in policies)
    trained = {str(policy.training["sensors"]) for policy in policies if "sensors" in policy.training}
    return folders, [law for law in laws if law != NO_LAW], trained
