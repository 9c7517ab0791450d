"""What birthsim evaluate does: controllers over seeded episodes, tables, JSON and figures."""

from pathlib import Path

from agents.residual.settings import NO_LAW
from baselines.bench.evaluation import data, merged, overview, table
from baselines.bench.pieces import controller_settings, evaluation_tasks, file_hash, gathered
from baselines.controller import RESIDUAL
from baselines.work.tasks import run_tasks
from birthsim.command_line.settings import RANDOMIZE
from birthsim.command_line.worlds import check_environment, check_world, policy_of, warn_of_worlds, with_options
from birthsim.commands.evaluate import Settings
from birthsim_env.extras import installation
from birthsim_env.files import make_folder, own_folder, whole_results, write_json, write_text
from birthsim_env.ids import environment_ids, rig_for
from birthsim_env.parts.drawn.randomization import described


def run(settings: Settings) -> None:
    """Run the episodes that the folder lacks; write and print tables."""
    settings.controller = settings.controller or (["backstepping"] if settings.policy is None else ["residual"])
    rig = rig_for(settings.env, settings.parameters)
    if settings.env not in environment_ids():  # one with a law inside may be
        check_environment(settings.env)
    # Processes that work beside this one find an id with a controller inside by the package that registers it.
    environment = f"agents:{settings.env}" if "Residual" in settings.env else settings.env
    names = settings.controller
    if "residual" in names and settings.policy is None:
        settings.policy = policy_of(settings.env)
    policies, laws, learned_with = _policies(settings.policy)
    if policies:
        names = ["backstepping", *laws] if names == ["residual"] else names
        names = list(dict.fromkeys([*names, "residual"]))
    names = with_options([name for name in names if name != "residual"], settings.set)
    world = {
        "sensors": settings.sensors, "randomize": RANDOMIZE[settings.randomize], **settings.parts(),
    }  # fmt: skip
    span = settings.episodes, settings.seed
    pieces = {name: evaluation_tasks(name, controller_settings(name, rig), environment, world, *span) for name in names}
    check_world(settings.env, parameters=rig, **world)  # which compiles: names are looked at before
    warn_of_worlds([*pieces, *([RESIDUAL] if policies else [])], settings.seed, settings.episodes)
    known = len(pieces)
    if policies:
        from agents.policy.files import WEIGHTS
        from agents.policy.pieces import evaluate_learned
    for place in policies:
        name = "residual" if len(policies) == 1 else f"residual {place.name}"
        # The code of policies counts, which lies here; a policy that has been trained anew is another one.
        own = {
            "controller": "residual", "source": file_hash(str(place / WEIGHTS)), "rig": rig.to_dict(), "policy": str(place),
        }  # fmt: skip
        pieces[name] = evaluation_tasks(name, own, environment, world, *span, work=evaluate_learned)
    folder, drawn = make_folder(settings.out), described(rig, world["randomize"], world["sensors"])
    print(drawn)
    if learned_with - {settings.sensors}:
        print(f"the policy was trained with {', '.join(sorted(learned_with))} sensors; here they are {settings.sensors}")
    every = [task for tasks in pieces.values() for task in tasks]
    with own_folder(folder):
        done, failures = run_tasks(every, folder, settings.jobs, "episodes", settings.cluster)
    if failures:
        name, problem = next(iter(failures.items()))
        raise ValueError(f"{len(failures)} pieces failed, the first {name}: {problem}; what is complete is kept")
    evaluations = [gathered(name, [done[task.name] for task in tasks]) for name, tasks in pieces.items()]
    # pyplot takes half a second to load; a user who mistypes an argument should not wait for it.
    from baselines.figures.runs import error_over_time
    from baselines.figures.style import drawn_for

    caption = f"{settings.env}, {settings.episodes} episodes from seed {settings.seed}, {settings.sensors} sensors, "
    caption += f"--randomize {settings.randomize}"
    caption += "".join(f", {name.replace('_', ' ')}: {part}" for name, part in settings.parts().items())
    classical, learned = evaluations[:known], evaluations[known:]
    seeds = ""
    if len(learned) > 1:
        from agents.policy.seeds import as_table, seed_metrics
        from agents.reports.learning_curves import draw_learning_curves, learning_curves

        together = merged(learned, f"residual, {len(learned)} seeds")
        evaluations = [*classical, together]
        seeds = "".join(f"\n{as_table(seed_metrics(one, learned))}\n" for one in classical)
    lines = [caption, "", overview(evaluations)]
    results = [evaluation.to_dict() for evaluation in (*classical, *learned)]
    with drawn_for(settings.style), whole_results(folder) as place:
        write_text(place / "evaluation.csv", data(evaluations))
        write_text(place / "evaluation.md", f"{caption}\n\n{drawn}\n\n{table(evaluations)}\n{seeds}")
        write_json(place / "evaluation.json", {"arguments": settings.shown(), "rig": rig.to_dict(), "results": results})
        # The only file that differs from run to run.
        write_json(place / "times.json", {"us_per_lane_and_call": {one.controller: one.cost for one in evaluations}})
        drawings = error_over_time(evaluations, caption, place)
        if seeds:
            write_text(place / "seeds.md", f"{caption}\n{seeds}")
            drawings += draw_learning_curves(learning_curves(policies), place)
    print("\n".join(lines))
    files = ", ".join(path.name for path in drawings)
    print(f"\nwritten to {folder}/: evaluation.md and .csv (every metric), evaluation.json, times.json, {files}")


def _policies(path: str | None) -> tuple[list[Path], list[str], set[str]]:
    """The policy folders at ``path``, the laws that those policies sit on, and the sensors that they were trained with."""
    if path is None:
        return [], [], set()
    try:
        from agents.policy.files import read_policy
        from agents.policy.seeds import policy_folders
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: {installation('agents')}") from error
    folders = policy_folders(path)
    policies = [read_policy(folder) for folder in folders]
    laws = dict.fromkeys(policy.settings.law for policy in policies)
    trained = {str(policy.training["sensors"]) for policy in policies if "sensors" in policy.training}
    return folders, [law for law in laws if law != NO_LAW], trained
