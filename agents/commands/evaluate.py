"""birthsim-evaluate: controllers over seeded episodes, tables, JSON and figures."""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium

import birthsim_env
from agents.residual.settings import NO_LAW
from baselines.bench.evaluation import Evaluation, evaluate, overview, table
from baselines.commands.evaluate_all import JOBS, evaluate_all
from baselines.commands.parts import add_parts, add_set, environment_parts, with_options
from baselines.commands.shared import RANDOMIZE, check_world, policy_of, run, seed_number, whole
from baselines.files import make_folder, write_json, write_text
from baselines.registry import controller_names, make_controller
from birthsim_env.parts.randomization import described


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim-evaluate",
        description="Evaluate controllers: the same seeds, so the same worlds, for each of them. With --all on every "
        "environment, with every sensor model, on the rig as given and on rigs drawn at random, and how the stiffness feels.",
        epilog="Without --policy every named controller runs; with it the trained residual runs beside those named, or else "
        "beside the paper's law and the one that it sits on. With --all what the output folder holds of the same settings, rig "
        "and code is kept, so that an interrupted run goes on.",
    )
    parser.add_argument(
        "--all", action="store_true", help="compare under all conditions; --env, --sensors, --randomize narrow them"
    )
    parser.add_argument("--env", help="environment id (default: BirthSIM/Circle-v1, with --all every one)")
    parser.add_argument(
        "--controller",
        "--controllers",
        nargs="+",
        metavar="NAME",
        help=f"one or more of {', '.join(controller_names())}, or path/to/file.py:Class (default: backstepping, with --policy "
        "residual, with --all every one of the registry that is not slow)",
    )
    parser.add_argument(
        "--policy",
        help="for the controller 'residual': a folder that birthsim-train wrote, of one training seed or of several, or the "
        "name of what comes with the package, such as circle (default: that of the scenario); not with --all",
    )
    parser.add_argument("--episodes", type=whole, default=32, help="per controller, with --all per cell (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=0, help="seed of the first episode (default: %(default)s)")
    parser.add_argument("--sensors", choices=("ideal", "lab"), help="default: ideal, with --all both")
    parser.add_argument(
        "--randomize",
        choices=tuple(RANDOMIZE),
        help="what differs between episodes: the plant, the scenario, both (default) or nothing; with --all the default is "
        "first the scenario and then both",
    )
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    add_parts(parser)
    add_set(parser)
    parser.add_argument("--jobs", type=whole, help=f"processes side by side, with --all (default: {JOBS})")
    studies = parser.add_mutually_exclusive_group()
    studies.add_argument("--no-studies", action="store_true", help="with --all: leave out the studies of the stiffness felt")
    studies.add_argument("--studies-only", action="store_true", help="with --all: nothing but these studies, some minutes")
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="folder for evaluation.json, evaluation.md, with --all comparison.*, and figures",
    )
    run(parser, _evaluate)


def _evaluate(arguments: argparse.Namespace) -> None:
    if arguments.all:
        if arguments.policy is not None:
            raise ValueError("--policy with --all; allowed: without it, --all compares controllers that need no policy")
        if environment_parts(arguments):
            raise ValueError("--reference or --user-force with --all; allowed: without it, --all has its own moving hands")
        evaluate_all(arguments)
        return
    if arguments.jobs is not None or arguments.no_studies or arguments.studies_only:
        raise ValueError("--jobs, --no-studies and --studies-only; allowed: with --all")
    arguments.env = arguments.env or "BirthSIM/Circle-v1"
    arguments.controller = arguments.controller or (["backstepping"] if arguments.policy is None else ["residual"])
    arguments.sensors, arguments.randomize = arguments.sensors or "ideal", arguments.randomize or "all"
    rig = birthsim_env.physics.parameters.load_parameters(arguments.parameters)
    if arguments.env not in [name for name in gymnasium.registry if name.startswith("BirthSIM/")]:
        allowed = ", ".join(
            sorted(name for name in gymnasium.registry if name.startswith("BirthSIM/") and "Residual" not in name)
        )
        raise ValueError(f"--env {arguments.env!r}; allowed: {allowed}")
    names = list(arguments.controller)
    if "residual" in names and arguments.policy is None:
        arguments.policy = policy_of(arguments.env)
    policies, laws = _policies(arguments.policy)
    if policies:
        names = ["backstepping", *laws] if names == ["residual"] else names
        names = list(dict.fromkeys([*names, "residual"]))
    names = with_options([name for name in names if name != "residual"], arguments.set)
    controllers = [(name, make_controller(name, rig)) for name in names]
    known = len(controllers)
    for place in policies:
        name = "residual" if len(policies) == 1 else f"residual {place.name}"
        controllers.append((name, make_controller("residual", rig, policy=place)))
    setting = {
        "parameters": rig, "sensors": arguments.sensors, "randomize": RANDOMIZE[arguments.randomize],
        **environment_parts(arguments),
    }  # fmt: skip
    check_world(arguments.env, **setting)
    folder, drawn = make_folder(arguments.out), described(rig, setting["randomize"])
    print(drawn)
    evaluations: list[Evaluation] = []
    for name, controller in controllers:
        try:
            evaluations.append(evaluate(arguments.env, controller, name, arguments.episodes, arguments.seed, **setting))
        except KeyboardInterrupt:
            if not evaluations:
                raise
            break
        if len(evaluations[-1].seeds) < arguments.episodes:
            break  # interrupted: what is complete is written, and no further controller is begun
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from baselines.figures.runs import error_over_time

    caption = f"{arguments.env}, {arguments.episodes} episodes from seed {arguments.seed}, {arguments.sensors} sensors, "
    caption += f"randomised: {arguments.randomize}"
    caption += "".join(f", {name.replace('_', ' ')}: {part}" for name, part in environment_parts(arguments).items())
    classical, learned = evaluations[:known], evaluations[known:]
    # A seed that was interrupted is kept, but the table over seeds compares the same episodes.
    complete = [one for one in learned if len(one.seeds) == arguments.episodes]
    text, pictures = table(evaluations), "error_over_time"
    if len(complete) > 1:
        from agents.policy.seeds import learning_curves, merged, seed_table
        from agents.reports.learning_curves import draw_learning_curves

        together = merged(complete, f"residual, {len(complete)} seeds")
        evaluations = [*classical, together]
        text = "\n\n".join([table(evaluations), *(seed_table(one, complete) for one in classical)])
        pictures += ", learning_curves"
        draw_learning_curves(learning_curves(policies), folder)
    lines = [caption, "", overview(evaluations)]
    write_text(folder / "evaluation.md", f"{caption}\n\n{drawn}\n\n{text}\n")
    shown = {key: str(value) for key, value in vars(arguments).items()}
    results = [evaluation.to_dict() for evaluation in (*classical, *learned)]
    write_json(folder / "evaluation.json", {"arguments": shown, "rig": rig.to_dict(), "results": results})
    error_over_time(evaluations, caption, folder)
    print("\n".join(lines))
    print(f"\nwritten to {folder}/: evaluation.md (every metric), evaluation.json, {pictures} (.png, .svg)")


def _policies(path: str | None) -> tuple[list[Path], list[str]]:
    """The policy folders at ``path``, and the laws that those policies sit on."""
    if path is None:
        return [], []
    try:
        from agents.policy.files import load_policy
        from agents.policy.seeds import policy_folders
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: pip install 'birthsim[agents]'") from error
    folders = policy_folders(path)
    laws = dict.fromkeys(load_policy(folder).settings.law for folder in folders)
    return folders, [law for law in laws if law != NO_LAW]


if __name__ == "__main__":
    main()
