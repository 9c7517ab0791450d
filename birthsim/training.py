"""What birthsim train does: residual policies by reinforcement learning or by gradients, several seeds in one command."""

import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents.residual.settings import LAWS, ResidualSettings
from agents.training.configuration import TrainingSettings, load_configuration, override
from agents.training.time_split import shares
from baselines.work.side_by_side import side_by_side
from birthsim.command_line.settings import RANDOMIZE
from birthsim.command_line.worlds import check_environment, check_world
from birthsim.commands.train import Settings
from birthsim_env.extras import installation
from birthsim_env.files import make_folder, own_folder, write_json
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.physics.rig.parameters import Parameters, load_parameters


def run(settings: Settings) -> None:
    """Train every seed and report."""
    missing = [name for name in ("torch", "stable_baselines3") if find_spec(name) is None]
    if missing:
        raise ValueError(f"no {' and no '.join(missing)}; training needs the extra: {installation('agents')}")
    training, residual = _settings(settings)
    rig = load_parameters(settings.parameters)
    for name, hand in training.worlds():
        check_environment(name, residual=True)
        check_world(name, parameters=rig, randomize=training.randomize, sensors=training.sensors, **hand)
    first = training.seed if settings.seed is None else settings.seed
    seeds = range(first, first + settings.seeds)
    make_folder(settings.out)
    work = [
        (replace(training, seed=seed), residual, settings.out / f"seed_{seed}", rig, k % settings.jobs)
        for k, seed in enumerate(seeds)
    ]
    print(described(rig, training.randomize, training.sensors))
    results: dict[int, dict[str, Any]] = {}
    try:
        side_by_side(_one, work, settings.jobs, results.__setitem__)
    except BaseException:
        if settings.jobs > 1:
            print(file=sys.stderr)  # the bar of a process that has been ended has no end of line
        raise
    _report(training, residual, list(seeds), [results[k] for k in range(len(work))])
    print(f"written to {settings.out}/")


def _settings(settings: Settings) -> tuple[TrainingSettings, ResidualSettings]:
    """The configuration, with what the options say instead."""
    training, residual = load_configuration(settings.config)
    said = {
        "environment": settings.env, "algorithm": settings.algorithm, "steps": settings.steps, "sensors": settings.sensors,
        "until": settings.until, "randomize": None if settings.randomize is None else RANDOMIZE[settings.randomize],
    }  # fmt: skip
    allowed = {"law": settings.law, "impedance": settings.impedance, "authority": settings.authority}
    return (
        override(training, **{name: value for name, value in said.items() if value is not None}),
        override(residual, **{name: value for name, value in allowed.items() if value is not None}),
    )


def _one(
    settings: TrainingSettings, residual: ResidualSettings, folder: Path, rig: Parameters, position: int
) -> dict[str, Any]:
    from agents.training.trainer import train  # Stable-Baselines3 and torch take three seconds to load

    with own_folder(folder):
        reached = train(settings, residual, folder, rig, position)
        write_json(folder / "training.json", reached)
    return reached


def _report(training: TrainingSettings, residual: ResidualSettings, seeds: list[int], results: list[dict[str, Any]]) -> None:
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
    print(f"{seconds} s per seed with validation; the time of training alone:")
    for seed, result in zip(seeds, results, strict=True):
        print(f"seed {seed}: {shares(result['curve'][-1]['split'], result['curve'][-1]['environment_fraction'])}")
