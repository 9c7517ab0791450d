"""Long work in pieces: each is written as soon as it is complete, and taken from there when the same is asked for again."""

import hashlib
import json
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from tqdm import tqdm

import birthsim_env
from baselines.work.asked import asked, note
from baselines.work.calls import called_by
from baselines.work.definitions import take_stock
from baselines.work.side_by_side import side_by_side
from birthsim_env.endings import later_signals, one_signal_later
from birthsim_env.files import finite, temporary_folder, write_json
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each

Result = dict[str, Any]

WORDS = "it ends once what runs has kept what it has; once more: at once"
"""Said when a signal asks work to end whose pieces keep more than their results."""

MOST = 2**28
"""Bytes of a piece; those with a trace of 64 episodes have a few million."""

_PIECE = {"code": dict, "used": Each(str), "result": dict, "sha256": str}


@dataclass(frozen=True)
class Task:
    """One piece: ``work(**settings)`` of a module's function gives its result; settings and result are JSON.

    ``name`` begins the name of its file below the folder. Where it ``keeps`` something between kills, ``work`` also gets a
    folder of its own for that, ``place``, and the path of a file, ``ending``, or None. Once there is such a file it shall keep
    what it has, and raise. Neither is a part of the settings.
    """

    name: str
    work: Callable[..., Result]
    settings: dict[str, Any]
    keeps: bool = False

    def file(self) -> str:
        """Its file's name: the task's and a hash of its settings, so that other settings have another file."""
        return f"{self.name}-{_digest(self.settings)[:16]}.json"


def code_stamp(work: Callable[..., Any], used: Mapping[str, str] = MappingProxyType({})) -> dict[str, str]:
    """What computes: the package's version, a hash of all that ``work`` and the entries ``used`` call, and its libraries."""
    return {"version": birthsim_env.__version__, "called": _digest(called_by([work], used)), **_libraries()}


@cache
def _libraries() -> dict[str, str]:
    return {"python": platform.python_version(), **{name: version(name) for name in ("numpy", "numba", "scipy")}}


def run_tasks(
    tasks: Sequence[Task], folder: Path, jobs: int, title: str, cluster: str | None = None
) -> tuple[dict[str, Result], dict[str, str]]:
    """Results by name, and what went wrong by name, of the tasks that ``folder`` does not hold yet and of those it does.

    A piece is taken from the folder where its settings and ``code_stamp`` are those of now; the screen says how many are.
    ``jobs`` processes work side by side, or those of a ``cluster``, as ``side_by_side`` says; the caller has the folder to
    itself, by ``own_folder``. An interrupt keeps the complete pieces, and comes once those that run beside each other have
    ended, where some of them keep more; a second one comes at once.
    """
    take_stock()
    paths = {task.name: folder / task.file() for task in tasks}
    results = {task.name: result for task in tasks if (result := _read(paths[task.name], task)) is not None}
    missing = [task for task in tasks if task.name not in results]
    failures: dict[str, str] = {}
    ended: list[str] = []
    if results:
        print(f"{title}: {len(results)} of {len(tasks)} are there with these settings, rig and code, and are kept")
    with tqdm(total=len(tasks), initial=len(results), desc=title, unit=" pieces", disable=not missing) as bar:

        def take(number: int, outcome: tuple[Result, dict[str, str]] | str | Ended) -> None:
            task = missing[number]
            if isinstance(outcome, Ended):
                ended.append(outcome.said)
                return
            if isinstance(outcome, tuple):
                # A signal in between would leave a file that the last line does not count.
                with later_signals():
                    _write(paths[task.name], task, *outcome)
                    # As it would be read: one run gives the same as an interrupted one.
                    results[task.name] = _read(paths[task.name], task) or {}
            else:
                failures[task.name] = outcome
            bar.update()

        try:
            waits = cluster is None and min(jobs, len(missing)) > 1 and any(task.keeps for task in missing)
            with _ending(waits) as ending:
                pieces = [(task, paths[task.name].with_suffix(""), ending) for task in missing]
                side_by_side(_attempt, pieces, jobs, take, cluster)
            if ended:
                raise OSError("work was asked to end; what is complete is kept, and the same command goes on")
        except KeyboardInterrupt:
            bar.close()
            print(*filter(None, ended), sep="\n", end="\n" * any(ended))
            print(f"{title}: {len(results)} of {len(tasks)} are complete and kept; the same command goes on")
            raise
    return {task.name: results[task.name] for task in tasks if task.name in results}, failures


def result_of(task: Task, folder: Path) -> Result:
    """The result of one task: from ``folder`` where that holds it, else worked out here, and then written there."""
    take_stock()
    path = folder / task.file()
    if _read(path, task) is None:
        _write(path, task, task.work(**task.settings), asked())
    return _read(path, task) or {}


def is_kept(task: Task, folder: Path) -> bool:
    """Whether ``folder`` holds the result of a task, of these settings and this code."""
    return _read(folder / task.file(), task) is not None


def _write(path: Path, task: Task, result: Result, used: Mapping[str, str]) -> None:
    content = finite({"settings": task.settings, "result": result})
    path.parent.mkdir(parents=True, exist_ok=True)
    made = {"code": code_stamp(task.work, used), "used": dict(used)}
    write_json(path, {**made, **content, "sha256": _digest([made["used"], content["result"]])})


def _read(path: Path, task: Task) -> Result | None:
    """The result in a file; None where there is none, where it is not as it was written, and where other code made it."""
    try:
        content = read_json("piece", path, _PIECE, MOST)
    except ValueError:
        return None
    result: Result = content["result"]
    if content["sha256"] != _digest([content["used"], result]) or content["code"] != code_stamp(task.work, content["used"]):
        return None
    note(content["used"])
    return result


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


class Ended(NamedTuple):
    """A piece that ended early because that was asked for, with what it ``said``."""

    said: str


@contextmanager
def _ending(waits: bool) -> Iterator[Path | None]:
    """The file that asks pieces to end, which the first signal that asks this process to end makes, if this ``waits``."""
    if not waits:
        yield None
        return
    with temporary_folder() as folder:
        ending = folder / "ending"
        with one_signal_later(WORDS, ending.touch):
            yield ending


def _attempt(task: Task, place: Path, ending: Path | None) -> tuple[Result, dict[str, str]] | str | Ended:
    """The result and the entries asked for, or what went wrong in words: one that fails must not cost the others' results."""
    if ending and ending.exists():
        return Ended("")
    try:
        return task.work(**task.settings, **({"place": str(place), "ending": ending} if task.keeps else {})), asked()
    except Exception as error:
        if ending and ending.exists():
            return Ended(str(error))
        return f"{type(error).__name__}: {error}"
