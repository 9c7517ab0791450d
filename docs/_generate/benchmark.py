"""The benchmark's tables: splits of seeds, and the tasks of its suites."""

from birthsim.benchmark.suites import SUITES, BenchmarkTask
from birthsim_env.splits import SPLITS


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
    rows = [
        f"| `{one.name}` | `{one.environment}` | `{one.sensors}` | {_options(one)} | {'yes' if one.is_scored else 'no'} |"
        for one in tasks
    ]
    head = ["| task | environment | sensors | besides | scale of scores |", "|---|---|---|---|---|"]
    return "\n".join([f"**`{name}`**, {len(tasks)} tasks:", "", *head, *rows])


def _options(task: BenchmarkTask) -> str:
    said = [] if task.force_sensor else ["no force sensor"]
    said += [f"friction `{task.friction}`"] if task.friction else []
    said += ["rigs far beyond those of training"] if task.ranges else []
    return ", ".join(said)
