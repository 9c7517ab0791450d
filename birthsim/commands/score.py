"""birthsim score: a policy of any library, or a controller, on the test split of an environment or of a suite."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from birthsim.command_line.settings import EPISODES, MANY, WORLD, Processes, Sensors, WorldSeed, number, whole


@dataclass(kw_only=True)
class Settings(Processes):
    """Judge policies: score, success and settled error on feasible worlds, with 95 % intervals, and a row for the leaderboard.

    A policy is FILE.zip of Stable-Baselines3 (PPO, SAC, TQC, RecurrentPPO), a folder that birthsim train wrote, FILE.onnx,
    path/to/file.py:Name, or the name of a controller or of a policy of the package. Several policies are training seeds of one
    entry. If each task of a suite has its own policy, {task} stands for the name of the task and {scenario} for that of its
    scenario. Stable-Baselines3 unpickles archives, which can run any code: judge only archives whose maker you trust.

    The folder keeps complete results: after Ctrl-C or a kill the same command continues.
    """

    policy: Annotated[list[str], MANY, Parameter(metavar="POLICY...")] = field(kw_only=False)
    """The policy to be judged, in one of the forms above."""
    suite: Annotated[Literal["classic", "open", "rail", "all"] | None, Parameter(group=WORLD)] = None
    """Every task of a suite, or of classic and open (all), instead of one environment."""
    tasks: Annotated[list[str] | None, MANY, Parameter(group=WORLD, metavar="TASK...")] = None
    """Tasks of the suites by their names, instead of a whole suite; write POLICY before this option."""
    env: Annotated[str | None, Parameter(group=WORLD, metavar="ID", help="Environment. [default: BirthSIM/Circle-v2]")] = None
    sensors: Sensors = "ideal"
    no_force_sensor: Annotated[bool, Parameter(group=WORLD)] = False
    """Do not measure the hand's force."""
    episodes: Annotated[int, whole(1, EPISODES)] = 64
    """Number of worlds of each task."""
    seed: WorldSeed | None = None
    """Seed of the first world, or a split, whose first seed it is. [default: test]"""
    policy_period: Annotated[float, number("s", above=0.0, most=1.0)] = 0.01
    """Time between two actions of an archive, an ONNX file or a function."""
    normalize: Annotated[str | None, Parameter(metavar="FILE")] = None
    """For an archive: the file that VecNormalize.save wrote."""
    name: Annotated[str | None, Parameter(metavar="NAME")] = None
    """Name of the entry in its row. [default: the name of the policy]"""
    out: Path
    """Folder for score.json and results so far."""


def main(settings: Settings) -> None:
    """Run what the folder lacks, print a table and write the row; what that needs takes seconds to load."""
    from birthsim.benchmark.scoring import NAME, judge, plan
    from birthsim.command_line.worlds import warn_of_worlds
    from birthsim_env.splits import TEST

    force_sensor, seed = not settings.no_force_sensor, TEST.first if settings.seed is None else settings.seed
    world = settings.env, settings.sensors, force_sensor, settings.suite, settings.tasks, settings.episodes, seed
    own = plan(settings.policy, *world, settings.policy_period, settings.normalize, settings.name)
    warn_of_worlds(settings.policy, seed, settings.episodes)
    scored = judge(own, settings.out, settings.jobs, settings.cluster, True)
    if not all(task.is_scored for task in own.tasks):
        print("no score: only tasks of the suites have a scale")
    print(f"{scored}\n\nwritten to {settings.out}/: {NAME}")
