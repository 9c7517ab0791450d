"""The benchmark's tables: splits of seeds, the tasks of its suites, and the records of each environment."""

from collections.abc import Callable
from functools import partial

from birthsim.benchmark.suites import SUITES, BenchmarkTask
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import names
from birthsim_env.splits import SPLITS
from lab.studies.leaderboard.records import record


def splits() -> str:
    """A row for each split."""
    rows = [
        f"| `{one.name}` | {' and '.join(f'{own.start} to {own.stop - 1}' for own in one.ranges)} | worlds {one.about} |"
        for one in SPLITS.values()
    ]
    return "\n".join(["| split | seeds | worlds |", "|---|---|---|", *rows])


def suites() -> str:
    """A table of tasks for each suite."""
    return "\n\n".join(_table(name, tasks) for name, tasks in SUITES.items())


def _table(name: str, tasks: tuple[BenchmarkTask, ...]) -> str:
    rows = [f"| `{one.name}` | `{one.environment}` | `{one.sensors}` | {_options(one)} |" for one in tasks]
    head = ["| task | environment | sensors | besides |", "|---|---|---|---|"]
    return "\n".join([f"**`{name}`**, {len(tasks)} tasks:", "", *head, *rows])


def _options(task: BenchmarkTask) -> str:
    said = [] if task.force_sensor else ["no force sensor"]
    said += [f"friction `{task.friction}`"] if task.friction else []
    said += ["rigs far beyond those of training"] if task.ranges else []
    return ", ".join(said)


def records() -> dict[str, Callable[[], str]]:
    """File -> what returns its text, of each environment: who holds the records of its tasks, and how open these are."""
    ids = map(environment_id, names("scenario"))
    return {f"record-{name.removeprefix('BirthSIM/')}.md": partial(record, name) for name in ids}
