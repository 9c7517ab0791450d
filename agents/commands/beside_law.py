"""Residual policies of several seeds beside the law that they sit on, in the same worlds.

python -m agents.commands.beside_law --policy DIR --sensors honest --episodes 128 --seed 80000
"""

from __future__ import annotations

import argparse

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agents.training.validation import Score, validate
from baselines.bench.statistics import crossed_interval, number, quantile
from baselines.commands.shared import EPISODES, run, seed_number, whole_up_to
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.compiled.lanes import Array

HEAD = (
    "settled error, mm: median",
    "95 %",
    "less than the law: median of the pairs, mm",
    "mean, mm",
    "stiffness, %",
    "lost",
)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="agents.commands.beside_law", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--policy", required=True, metavar="DIR", help="folder that birthsim-train wrote")
    parser.add_argument("--sensors", choices=tuple(SENSORS), default="honest", help="default: %(default)s")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--episodes", type=whole_up_to(EPISODES), default=128, help="default: %(default)s")
    parser.add_argument("--seed", type=seed_number, default=80000, help="of the first episode (default: %(default)s)")
    run(parser, _compare)


def _compare(arguments: argparse.Namespace) -> None:
    try:
        from agents.policy.files import load_policy
        from agents.policy.seeds import policy_folders
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: pip install 'birthsim[agents]'") from error
    folders = policy_folders(arguments.policy)
    policies = [load_policy(folder) for folder in folders]
    if len({(policy.environment, policy.settings) for policy in policies}) > 1:
        raise ValueError(f"--policy {arguments.policy!r} holds policies of several settings; allowed: seeds of one training")
    settings = policies[0].settings
    env = gymnasium.make_vec(
        policies[0].environment, num_envs=arguments.episodes, sensors=arguments.sensors, parameters=arguments.parameters,
        randomize=True, **settings.to_dict(),
    )  # fmt: skip
    law = validate(env, lambda seen: np.zeros((len(seen), settings.size), np.float32), arguments.seed)
    scores = [validate(env, policy.network.actions, arguments.seed) for policy in policies]
    env.close()
    within = law.feasible
    print(f"{int(within.sum())} of {arguments.episodes} episodes are within the rig's strength; 95 % intervals of pairs.\n")
    print(f"| | {' | '.join(HEAD)} |\n|{'---|' * (1 + len(HEAD))}")
    print(_row(settings.law, law, within))
    for folder, score in zip(folders, scores, strict=True):
        print(_row(folder.name, score, within, (law.error - score.error)[None, within]))
    print(_less("all seeds", np.stack([law.error - score.error for score in scores])[:, within]))


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
    told = []
    for statistic in (_median, _mean):
        low, high = crossed_interval(statistic, gained)
        told.append(f"{number(statistic(gained))} ({number(low)} to {number(high)})")
    return told


def _median(values: Array) -> float:
    return float(np.median(values))


def _mean(values: Array) -> float:
    return float(np.mean(values))


if __name__ == "__main__":
    main()
