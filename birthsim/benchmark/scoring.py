"""What ``birthsim score`` and ``birthsim.score`` do: policies are run in every task, and a row says what they reached."""

import platform
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from tqdm import tqdm

import birthsim_env
from baselines.work.tasks import Result, run_tasks
from birthsim.benchmark.contestant import Contestant, contestants_of
from birthsim.benchmark.pieces import score_under
from birthsim.benchmark.row import overall, table, task_row
from birthsim.benchmark.suites import BenchmarkTask, find_suite, find_task, task_of
from birthsim.command_line.settings import EPISODES, JOBS_AT_MOST, LARGEST_SEED
from birthsim.command_line.worlds import check_environment
from birthsim_env.files import make_folder, own_folder, whole_results, write_json
from birthsim_env.physics.rig.values import checked_count, path_of, shown
from birthsim_env.registry import names
from birthsim_env.splits import GUIDING, TEST, VALIDATION, caution, first_seed, split_of

FORMAT = "birthsim-score-2"

NAME = "score.json"
"""The file of a row."""

ENVIRONMENT = "BirthSIM/Circle-v2"
"""Where neither an environment nor a suite is asked for."""

SENSORS = "ideal"
"""Where none are asked for."""

LIBRARIES = ("numpy", "torch", "stable-baselines3", "sb3-contrib", "onnxruntime")
"""Whose versions a row has, of those that are installed."""


@dataclass(frozen=True)
class Scored:
    """What policies reached in the tasks of a benchmark.

    Parameters
    ----------
    row : dict
        As JSON takes it, ready for the leaderboard: ``entry``, ``kinds``, hashes of files, ``split``, ``tasks`` with ``score``,
        ``success``, ``error_mm`` and their 95 % intervals, and ``overall``. docs/benchmark.md lists all.

    Examples
    --------
    ``score`` returns one.

    >>> import birthsim
    >>> scored = birthsim.score("shut-valves", "BirthSIM/Probe-v3", episodes=2, progress=False)
    >>> scored.row["tasks"][0]["success"]["value"]
    0.0
    """

    row: dict[str, Any]

    def __str__(self) -> str:
        return table(self.row)


@dataclass(frozen=True)
class Plan:
    """Who is judged, and where; all of it has been looked at."""

    contestants: list[Contestant]
    tasks: tuple[BenchmarkTask, ...]
    suite: str
    seeds: range
    entry: str
    given: list[str]

    @property
    def learned(self) -> bool:
        """Whether it may have learned on worlds: a registered controller has not."""
        return any(one.kind != "controller" or one.given not in names("controller") for one in self.contestants)


def score(
    policy: Any,
    environment: str | None = None,
    *,
    sensors: str = SENSORS,
    force_sensor: bool = True,
    suite: str | None = None,
    tasks: Sequence[str] | None = None,
    episodes: int = 64,
    seed: int | str = TEST.name,
    policy_period: float = 0.01,
    normalize: Any = None,
    name: str | None = None,
    out: Any = None,
    jobs: int = 1,
    progress: bool = True,
) -> Scored:
    """Judge a policy on the test split of an environment, or of every task of a suite.

    Parameters
    ----------
    policy : str, path, object, or list of them
        The name of a controller or of a trained policy, ``"file.py:Name"``, a folder that ``train`` wrote, an archive ``.zip``
        of Stable-Baselines3, a file ``.onnx``; a model of Stable-Baselines3, a controller, or a function from observations
        (N, D) to actions (N, n). Several are the training seeds of one entry, as are those of a folder. ``{task}`` in a path or
        name stands for the task's name and ``{scenario}`` for that of its scenario, where each has a policy of its own.
    environment : str, optional
        An id, else ``"BirthSIM/Circle-v2"``; without ``suite`` and ``tasks``.
    sensors : str
        The sensor model of that environment.
    force_sensor : bool
        Whether the hand's force is measured there.
    suite : str, optional
        ``"classic"``, ``"open"`` or ``"all"``, both; their tasks say all of that.
    tasks : list of str, optional
        Names of tasks of these suites, instead of a whole one.
    episodes : int
        Worlds of each task.
    seed : int or str
        Of the first world, or the name of a split.
    policy_period : float
        s between two actions of a policy that is given as an archive, ONNX, model or function.
    normalize : path, optional
        The file that ``VecNormalize.save`` wrote, for an archive. A model that is still in its ``VecNormalize`` needs none.
    name : str, optional
        What the row calls the entry, else the name of the policy.
    out : path, optional
        Folder for ``score.json`` and what is complete, so that an interrupted call goes on; for policies that have a file.
    jobs : int
        Processes side by side, with ``out``.
    progress : bool
        Whether a bar is shown.

    Returns
    -------
    Scored
        Its ``row``; printed it is a table.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed; also for a policy of other spaces, and where a package is missing.

    Notes
    -----
    Actions are deterministic. Archives and files of ``VecNormalize`` are unpickled by Stable-Baselines3's loader, which may run
    code of whoever made them; nothing else of them is run.

    Examples
    --------
    A policy that holds the valves shut:

    >>> import birthsim, numpy as np
    >>> def still(observations):
    ...     return np.zeros((len(observations), 4), dtype=np.float32)
    >>> scored = birthsim.score(still, "BirthSIM/Probe-v3", episodes=2, progress=False)
    >>> abs(scored.row["tasks"][0]["score"]["value"]) < 10
    True
    """
    own = plan(policy, environment, sensors, force_sensor, suite, tasks, episodes, seed, policy_period, normalize, name)
    jobs = checked_count("jobs", jobs, 1, JOBS_AT_MOST)
    if said := caution(own.seeds, GUIDING if own.learned else (VALIDATION,)):
        warnings.warn(said.replace("--seed ", "seed = "), stacklevel=2)
    folder = None if out is None else path_of(out)
    if out is not None and folder is None:
        raise ValueError(f"out = {shown(out)}; allowed: None or the path of a folder")
    return judge(own, None if folder is None else Path(folder), jobs, None, progress)


def plan(
    policy: Any,
    environment: str | None,
    sensors: str,
    force_sensor: bool,
    suite: str | None,
    tasks: Sequence[str] | None,
    episodes: int,
    seed: int | str,
    policy_period: float,
    normalize: Any,
    name: str | None,
) -> Plan:
    """Who is judged, and where; ``ValueError`` names what cannot be."""
    episodes = checked_count("episodes", episodes, 1, EPISODES)
    first = checked_count("seed", first_seed(seed), 0, LARGEST_SEED)
    where = _tasks(environment, sensors, force_sensor, suite, tasks)
    given = list(policy) if isinstance(policy, list | tuple) else [policy]
    if not given:
        raise ValueError("policy = []; allowed: one or more policies")
    statistics = "" if normalize is None else path_of(normalize)
    if statistics is None:
        raise ValueError(f"normalize = {shown(normalize)}; allowed: None or the path of a file")
    found = [contestants_of(each, where[0], policy_period, statistics) for each in given]
    every = [one for own in found for one in own]
    for one in every:
        for task in where if one.differs else where[:1]:
            one.controller(task)
    said = [own[0].said for own in found]
    return Plan(every, where, suite or "", range(first, first + episodes), name or every[0].name, said)


def _tasks(
    environment: str | None, sensors: str, force_sensor: bool, suite: str | None, tasks: Sequence[str] | None
) -> tuple[BenchmarkTask, ...]:
    """Where a policy is judged: one environment, a suite, or named tasks."""
    given = {"environment": environment, "suite": suite, "tasks": tasks}
    several = [f"{name} = {shown(value)}" for name, value in given.items() if value is not None]
    if len(several) > 1:
        raise ValueError(f"{' with '.join(several)}; allowed: one of them")
    if environment is None and several and (sensors != SENSORS or force_sensor is not True):
        said = f"sensors = {shown(sensors)}, force_sensor = {shown(force_sensor)} with {several[0]}"
        raise ValueError(f"{said}; allowed: without them, each task of a suite has its own")
    if suite is not None:
        return find_suite(suite)
    if tasks is not None:
        if isinstance(tasks, str) or not tasks or len(set(tasks)) < len(tasks):
            raise ValueError(f"tasks = {shown(tasks)}; allowed: a list of names of tasks, each once")
        return tuple(map(find_task, tasks))
    check_environment(environment or ENVIRONMENT, given="environment =")
    return (task_of(environment or ENVIRONMENT, sensors, force_sensor),)


def judge(plan: Plan, folder: Path | None, jobs: int, cluster: str | None, progress: bool) -> Scored:
    """Run what the folder lacks, and write and return the row."""
    if folder is None:
        return _row(plan, _at_once(plan, progress))
    without = [one.name for one in plan.contestants if not one.has_file]
    if without:
        raise ValueError(f"out = {shown(str(folder))} with policy = {without[0]}, an object; allowed: without out, or a file")
    tasks = {
        (task.name, k): one.pieces(task, plan.seeds, f"{task.name}-{k}")
        for task in plan.tasks
        for k, one in enumerate(plan.contestants)
    }
    with own_folder(make_folder(folder)):
        every = [piece for pieces in tasks.values() for piece in pieces]
        done, failures = run_tasks(every, folder, jobs, "score", cluster)
    if failures:
        failed, problem = next(iter(failures.items()))
        raise ValueError(f"{len(failures)} pieces failed, the first {failed}: {problem}; what is complete is kept")
    found = [
        [_together([done[piece.name] for piece in tasks[task.name, k]]) for k in range(len(plan.contestants))]
        for task in plan.tasks
    ]
    scored = _row(plan, found)
    with whole_results(folder) as place:
        write_json(place / NAME, scored.row)
    return scored


def _at_once(plan: Plan, progress: bool) -> list[list[Result]]:
    """Results of each task and run, in this process."""
    found: list[list[Result]] = []
    with tqdm(total=len(plan.tasks) * len(plan.contestants), desc="score", unit=" pieces", disable=not progress) as bar:
        for task in plan.tasks:
            found.append([])
            for one in plan.contestants:
                law, rig = one.controller(task), task.rig.to_dict()
                span = plan.seeds.start, len(plan.seeds)
                found[-1].append(score_under(law, one.name, rig, task.environment, task.world, *span))
                bar.update()
    return found


def _together(pieces: Sequence[Result]) -> Result:
    """The pieces of one run in one task."""
    lists = {name: [value for piece in pieces for value in piece[name]] for name in pieces[0] if name != "seconds"}
    return {**lists, "seconds": sum(piece["seconds"] for piece in pieces)}


def _row(plan: Plan, found: Sequence[Sequence[Result]]) -> Scored:
    rows = [task_row(task, runs) for task, runs in zip(plan.tasks, found, strict=True)]
    return Scored(
        {
            "format": FORMAT,
            "entry": plan.entry,
            "given": plan.given,
            "policies": [one.name for one in plan.contestants],
            "kinds": [one.kind for one in plan.contestants],
            "sha256": [[one.hash(task) for one in plan.contestants] for task in plan.tasks],
            "suite": plan.suite,
            "split": split_of(plan.seeds),
            "seed": plan.seeds.start,
            "episodes": len(plan.seeds),
            "policy_period": [one.policy_period for one in plan.contestants],
            "training": [one.training(plan.tasks[0]) for one in plan.contestants],
            "tasks": rows,
            "overall": overall(rows),
            "seconds": round(sum(sum(one["seconds"]) for one in rows), 1),
            "versions": {"birthsim": birthsim_env.__version__, "python": platform.python_version(), **_versions()},
        }
    )


def _versions() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
