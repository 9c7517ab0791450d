"""Residual policies of several seeds beside the law that they sit on, in the same worlds.

birthsim study beside-law --policy DIR --sensors honest --episodes 128 --seed 80000
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agents.residual.privileged import acting
from agents.residual.settings import LAWS, ResidualSettings, is_one_of
from baselines.bench.statistics import LOST_ERROR, crossed_interval, number, quantile
from baselines.commands.shared import EPISODES, run, seed_number, whole_up_to
from baselines.work.tasks import Result
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import load_parameters
from studies.haptics.rendering import rendering
from studies.haptics.worlds import Condition

try:
    from agents.policy.controller import ResidualController
    from agents.policy.files import Policy, load_policy
    from agents.policy.seeds import policy_folders
    from agents.training.validation import Score, validate
except ImportError as error:
    raise SystemExit(f"{error}; a policy needs the extra: pip install 'birthsim[agents]'") from error

HEAD = (
    "settled error, mm: median",
    "95 %",
    "less than the law: median of the pairs, mm",
    "mean, mm",
    "stiffness error, %: median",
    "lost",
)
"""Columns of the table of errors."""

FELT = (
    "bandwidth, Hz: mean",
    "JND at 1 Hz: median",
    "own error, mm: median",
    "more bandwidth than the law: mean, Hz",
    "less JND than the law: mean",
    "less own error than the law: mean, mm",
    "lost",
)
"""Columns of the table of what a hand feels."""

GAINED = ("bandwidth", "jnd", "error")
"""Figures of what a hand feels that are compared with the law's."""

SETPOINT, PUSH = 2000.0, 10.0
"""N/m and N, of the multisine hand."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study beside-law", description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--policy", required=True, metavar="NAME", help="a folder of birthsim train or distill, or a shipped policy"
    )
    parser.add_argument(
        "--beside", nargs="+", default=[], metavar="NAME", help=f"what else runs: one or more of {', '.join(LAWS)}, or policies"
    )
    parser.add_argument("--sensors", choices=tuple(SENSORS), default="honest", help="default: %(default)s")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--episodes", type=whole_up_to(EPISODES), default=128, help="default: %(default)s")
    parser.add_argument("--seed", type=seed_number, default=80000, help="of the first episode (default: %(default)s)")
    parser.add_argument("--rigs", type=whole_up_to(1000), default=16, help="under multisine hands (default: %(default)s)")
    run(parser, _compare)


def _compare(arguments: argparse.Namespace) -> None:
    folders, policies = _seeds_of(arguments.policy)
    settings = policies[0].settings
    law, scores = _law(settings, policies[0].environment, arguments), _scores(policies, arguments)
    within, errors = law.feasible, np.stack([score.error for score in scores])
    print(f"{int(within.sum())} of {arguments.episodes} episodes are within the rig's strength; 95 % intervals of pairs.\n")
    print(f"| law | {' | '.join(HEAD)} |\n|{'---|' * (1 + len(HEAD))}")
    print(_row(settings.law, law, within))
    for folder, score in zip(folders, scores, strict=True):
        print(_row(folder.name, score, within, (law.error - score.error)[None, within]))
    print(_less("all seeds", (law.error - errors)[:, within]))
    for name in arguments.beside:
        if is_one_of(name, LAWS):
            others = {name: _law(replace(settings, law=name), policies[0].environment, arguments)}
        else:
            places, its = _seeds_of(name)
            others = {f"{name} {place.name}": score for place, score in zip(places, _scores(its, arguments), strict=True)}
        for label, score in others.items():
            print(_row(label, score, within))
        mean = np.mean([score.error for score in others.values()], axis=0)
        print(_less(f"all seeds, less than {name}", (mean - errors)[:, within]))
    if not _privileged(policies[0]):
        _feel(folders, settings, arguments)


def _seeds_of(name: str) -> tuple[list[Path], list[Policy]]:
    """Folders and policies of the seeds of one training."""
    folders = policy_folders(name)
    policies = [load_policy(folder) for folder in folders]
    if len({(policy.environment, policy.settings) for policy in policies}) > 1:
        raise ValueError(f"policy = {name!r} holds policies of several settings; allowed: seeds of one training")
    return folders, policies


def _law(settings: ResidualSettings, environment: str, arguments: argparse.Namespace) -> Score:
    """The law of ``settings`` alone."""
    env = _worlds(environment, settings, arguments)
    score = validate(env, lambda seen: np.zeros((len(seen), settings.size), np.float32), arguments.seed)
    env.close()
    return score


def _scores(policies: Sequence[Policy], arguments: argparse.Namespace) -> list[Score]:
    """Those of policies of the same settings."""
    env = _worlds(policies[0].environment, policies[0].settings, arguments)
    scores = [validate(env, acting(one.network.acting(), env, _privileged(one)), arguments.seed) for one in policies]
    env.close()
    return scores


def _privileged(policy: Policy) -> bool:
    return bool(policy.training.get("privileged", False))


def _worlds(environment: str, settings: ResidualSettings, arguments: argparse.Namespace) -> Any:
    return gymnasium.make_vec(
        environment, num_envs=arguments.episodes, sensors=arguments.sensors, parameters=arguments.parameters, randomize=True,
        **settings.to_dict(),
    )  # fmt: skip


@dataclass(frozen=True)
class _Learned(Condition):
    """A condition whose ``controller`` is the folder of a policy."""

    def law(self) -> ResidualController:
        return ResidualController(self.rig, self.controller)


def _feel(folders: Sequence[Path], settings: ResidualSettings, arguments: argparse.Namespace) -> None:
    """What a hand feels of the law and of each policy on it."""
    rig, rigs = load_parameters(arguments.parameters), arguments.rigs
    where = (rig, arguments.sensors, arguments.seed, rigs, settings.force_sensor)
    law, *policies = (
        _felt(rendering(condition, SETPOINT), rigs)
        for condition in (Condition(settings.law, *where), *(_Learned(str(folder), *where) for folder in folders))
    )
    print(f"\nMultisine hand of {PUSH:g} N at {SETPOINT:g} N/m, {rigs} rigs drawn from seed {arguments.seed}, at rest.\n")
    print(f"| law | {' | '.join(FELT)} |\n|{'---|' * (1 + len(FELT))}")
    for name, own in zip((settings.law, *(folder.name for folder in folders)), (law, *policies), strict=True):
        figures = [np.mean(own["bandwidth"]), quantile(own["jnd"], 0.5), quantile(own["error"], 0.5)]
        better = [""] * len(GAINED) if own is law else [_interval(_mean, _gained(law, own, key)[None]) for key in GAINED]
        print(f"| {name} | {' | '.join([*map(number, figures), *better])} | {own['lost']:g} |")
    better = [_interval(_mean, np.stack([_gained(law, own, key) for own in policies])) for key in GAINED]
    print(f"| all seeds | | | | {' | '.join(better)} | |")


def _gained(law: dict[str, Any], own: dict[str, Any], key: str) -> Array:
    """How much better than the law, per rig (rigs,)."""
    better: Array = own[key] - law[key]
    return better if key == "bandwidth" else -better


def _felt(found: Result, rigs: int) -> dict[str, Any]:
    """Means over poses and directions, per rig (rigs,), under hands of ``PUSH``, and the number of lost lanes.

    A lane that is lost counts with ``LOST_ERROR`` mm, a just noticeable difference of infinity and no bandwidth.
    """
    kept, lost = np.array(found["peak"]) == PUSH, np.array(found["lost"])
    line = int(np.argmin(np.abs(np.array(found["frequency"]) - 1.0)))
    values = {
        "bandwidth": np.where(lost, 0.0, found["bandwidth"]), "jnd": np.where(lost, np.inf, found["differences"][line]),
        "error": np.where(lost, LOST_ERROR, found["error_own_mm"]),
    }  # fmt: skip
    return {**{name: own[kept].reshape(-1, rigs).mean(axis=0) for name, own in values.items()}, "lost": lost[kept].sum()}


def _row(name: str, score: Score, within: NDArray[np.bool_], gained: Array | None = None) -> str:
    """A row of the table; ``gained`` (1, N), mm, less than the law's error."""
    error = [number(quantile(score.error[within], fraction)) for fraction in (0.5, 0.95)]
    stiffness = number(quantile(score.stiffness[within], 0.5))
    return (
        f"| {name} | {' | '.join([*error, *(_gains(gained) if gained is not None else ['', '']), stiffness])} | {score.lost} |"
    )


def _less(name: str, gained: Array) -> str:
    return f"| {name} | | | {' | '.join(_gains(gained))} | | |"


def _gains(gained: Array) -> list[str]:
    """Median and mean of ``gained`` (seeds, N), with intervals over seeds and episodes."""
    return [_interval(statistic, gained) for statistic in (_median, _mean)]


def _interval(statistic: Callable[[Array], float], gained: Array) -> str:
    low, high = crossed_interval(statistic, gained)
    return f"{number(statistic(gained))} ({number(low)} to {number(high)})"


def _median(values: Array) -> float:
    return float(np.median(values))


def _mean(values: Array) -> float:
    return float(np.mean(values))
