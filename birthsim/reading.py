"""Teaching of networks that read a rig, several seeds in one call or command."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agents.reader.settings import ReaderSettings, load_reader_settings
from baselines.tables import aligned
from baselines.work.side_by_side import side_by_side
from birthsim_env.files import make_folder, own_folder, write_json
from birthsim_env.ids import rig_for
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters

HEAD = ("parameter", "reader, median", "95 %", "filter, median", "95 %", "within its deviation")


@dataclass(frozen=True)
class Plan:
    """Teachings of several seeds that have been looked at, and how many of them run side by side."""

    settings: ReaderSettings
    rig: Parameters
    seeds: tuple[int, ...]
    jobs: int
    out: Path


def plan(
    config: str | os.PathLike[str], out: Path, seed: int | None, seeds: int, jobs: int, parameters: Any, changes: dict[str, Any]
) -> Plan:
    """Teachings that can begin; ``ValueError`` names what cannot be."""
    settings = load_reader_settings(config, **changes, **({} if seed is None else {"seed": seed}))
    rig = rig_for(environment_id(settings.scenarios[0]), parameters)
    if rig.linkage.is_rail:
        raise ValueError("parameters = a rail; allowed: a rig of two cylinders, which a reader reads")
    return Plan(settings, rig, tuple(range(settings.seed, settings.seed + seeds)), jobs, make_folder(out))


def carry_out(plan: Plan) -> dict[int, dict[str, Any]]:
    """Teach every seed; seed -> what it reached."""
    work = [
        (replace(plan.settings, seed=seed), plan.rig, plan.out / f"seed_{seed}", k % plan.jobs)
        for k, seed in enumerate(plan.seeds)
    ]
    results: dict[int, dict[str, Any]] = {}
    side_by_side(_one, work, plan.jobs, results.__setitem__)
    return {seed: results[k] for k, seed in enumerate(plan.seeds)}


def _one(settings: ReaderSettings, rig: Parameters, folder: Path, position: int) -> dict[str, Any]:
    from agents.reader.teaching import teach  # torch takes seconds to load

    with own_folder(folder):
        reached = teach(settings, rig, folder, position)
        write_json(folder / "training.json", reached)
    return reached


def report(plan: Plan, reached: dict[int, dict[str, Any]]) -> None:
    """Print how far off parameters are, beside what the filter alone finds."""
    for seed, result in reached.items():
        for scenario, moments in result["reached"].items():
            moment, found = list(moments.items())[-1]
            print(f"\nseed {seed}, {scenario} after {moment} on validation worlds: error of the logarithm, %")
            rows = []
            for name in found["within"]:
                errors = (f"{100 * found[who][share][name]:.1f}" for who in ("reader", "filter") for share in ("q50", "q95"))
                rows.append([name, *errors, f"{100 * found['within'][name]:.0f} %"])
            print(aligned(HEAD, rows))
        times = " and ".join(f"{seconds:.0f} s of CPU for {name}" for name, seconds in result["cpu_seconds"].items())
        print(f"{result['weights']:,} weights; {times}")
        print(f"to use it: admittance[reader={plan.out}/seed_{seed}/reader.npz]")
