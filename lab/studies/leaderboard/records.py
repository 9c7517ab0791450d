"""Who holds the record of a task, and how open the task is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from birthsim.benchmark.row import SHOWN, overall, said
from birthsim.benchmark.suites import SUITES, TASKS, BenchmarkTask
from lab.engine.tables import markdown
from lab.studies.leaderboard.entries import entries, entry
from lab.studies.leaderboard.who import is_learned, title

Known = dict[str, dict[str, Any]]
"""Name -> entry."""

SOLVED = 95.0
"""% of feasible worlds: a task counts as solved where the record's success is at least this."""


@dataclass(frozen=True)
class Standing:
    """An entry in one task.

    Parameters
    ----------
    name : str
        Of the entry.
    said : dict
        The entry.
    row : dict
        Of the task.
    """

    name: str
    said: dict[str, Any]
    row: dict[str, Any]

    @property
    def score(self) -> float:
        """By which entries are ordered."""
        return float(self.row["score"]["value"])

    @property
    def is_learned(self) -> bool:
        """Whether any of it was trained."""
        return is_learned(self.said)

    def shown(self, metric: str) -> str:
        """An estimate of the task's row with its interval."""
        return said(self.row[metric], *SHOWN[metric])


def every_entry() -> Known:
    """Name -> entry."""
    return {path.stem: entry(path) for path in entries()}


def standings(task: str, known: Known) -> list[Standing]:
    """Entries in a task, the best first."""
    found = [
        Standing(name, said, row)
        for name, said in known.items()
        for row in said["tasks"]
        if row["task"] == task and row["score"]["value"] is not None
    ]
    return sorted(found, key=lambda one: (-one.score, one.name))


@dataclass(frozen=True)
class Whole:
    """An entry over several tasks.

    Parameters
    ----------
    name : str
        Of the entry.
    said : dict
        The entry.
    score : float
        Interquartile mean over runs and tasks.
    shown : str
        The score with its 95 % interval.
    over : str
        What the interval is over, runs or episodes.
    success : float
        Mean over the tasks, from 0 to 1.
    """

    name: str
    said: dict[str, Any]
    score: float
    shown: str
    over: str
    success: float


def over_all(tasks: Sequence[BenchmarkTask], known: Known) -> list[Whole]:
    """Entries that have every one of some tasks, the best first."""
    found = []
    for name, told in known.items():
        rows = {row["task"]: row for row in told["tasks"]}
        own = [rows[task.name] for task in tasks if task.name in rows]
        if len(own) == len(tasks) and (whole := overall(own)):
            shown = f"{whole['iqm']:.1f} [{whole['low']:.1f}, {whole['high']:.1f}]"
            success = sum(row["success"]["value"] for row in own) / len(own)
            found.append(Whole(name, told, whole["iqm"], shown, whole["over"], success))
    return sorted(found, key=lambda one: (-one.score, one.name))


def openness(own: Sequence[Standing]) -> str:
    """In a word how open a task is, from its standings."""
    if not own:
        return "open, no entry yet"
    return "solved" if 100 * own[0].row["success"]["value"] >= SOLVED else "open"


def records(suite: str, known: Known) -> str:
    """A table of a suite: each task, who holds its record, and the best learned entry."""
    rows = [["task", "state", "record", "score", "success", "error, mm", "best learned", "its score"]]
    for task in SUITES[suite]:
        own = standings(task.name, known)
        learned = next((one for one in own if one.is_learned), None)
        best = [title(own[0].name, own[0].said), *map(own[0].shown, SHOWN)] if own else ["-"] * 4
        rows.append(
            [f"`{task.name}`", openness(own), *best]
            + (["-", "-"] if learned is None else [title(learned.name, learned.said), learned.shown("score")])
        )
    return markdown(rows)


def record(environment: str) -> str:
    """A table of an environment: its tasks of the suites, how open each is, and the score to beat, with a word on both."""
    known = every_entry()
    tasks = [one for one in TASKS.values() if one.environment == environment]
    if not tasks:
        return f"No task of the benchmark's suites is in `{environment}`."
    rows = [["task", "suite", "state", "record", "score to beat", "success of the record"]]
    for task in tasks:
        own = standings(task.name, known)
        suite = next(name for name, every in SUITES.items() if task in every)
        best = [title(own[0].name, own[0].said), own[0].shown("score"), own[0].shown("success")] if own else ["-"] * 3
        rows.append([f"`{task.name}`", f"`{suite}`", openness(own), *best])
    return f"{markdown(rows)}\n\nA task is *solved* where the record succeeds in {SOLVED:.0f} % of the feasible worlds or more."
