"""Long work in pieces: each is written as soon as it is complete, and taken from there when the same is asked for again."""

from __future__ import annotations

import hashlib
import json
import platform
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy
import scipy
from tqdm import tqdm

import birthsim_env
from baselines.work.claims import Claims
from baselines.work.files import finite, later_signals, write_json
from baselines.work.side_by_side import side_by_side

_ROOT = Path(__file__).resolve().parent.parent.parent
_PACKAGES = ("birthsim_env", "baselines", "agents", "studies")
_SHOWN_ONLY = (
    *("birthsim_env/drawing", "birthsim_env/drawing/rendering.py", "baselines/commands", "baselines/figures/runs.py"),
    *("baselines/bench/statistics.py", "studies/comparison/tables.py", "studies/comparison/figure.py"),
    *("studies/comparison/stiffness_figures.py", "birthsim_env/scores.json"),
    *("studies/haptics/figures.py", "baselines/figures/identification.py", "studies/haptics/tables.py"),
    *("agents/commands", "agents/reports", "agents/policies", "agents/training"),
    *("studies/sweeps/maps.py", "studies/sweeps/report.py", "studies/sweeps/search.py", "studies/sweeps/plan.py"),
)
"""Sources that show results and do not make them: pieces outlive a change of theirs."""

Result = dict[str, Any]


@dataclass(frozen=True)
class Task:
    """One piece: ``work(**settings)`` of a module's function gives its result; settings and result are JSON.

    ``name`` begins the name of its file below the folder; ``group`` is what the screen counts it under. Where it ``keeps``
    something between kills, ``work`` gets a folder of its own for that, ``place``, which is no part of the settings.
    """

    name: str
    group: str
    work: Callable[..., Result]
    settings: dict[str, Any]
    keeps: bool = False

    def code(self) -> dict[str, str]:
        """The ``code_stamp`` of what it runs."""
        module = getattr(self.work, "func", self.work).__module__
        package = module.partition(".")[0]
        return code_stamp(package if package in ("agents", "studies") else "baselines")

    def file(self) -> str:
        """Its file's name: the task's and a hash of code and settings, so that other code or settings have another file."""
        content = json.dumps([self.code(), self.settings], sort_keys=True)
        return f"{self.name}-{hashlib.sha256(content.encode()).hexdigest()[:16]}.json"


@cache
def code_stamp(package: str = "baselines") -> dict[str, str]:
    """What computes: the package's version, a hash of the sources up to those of ``package`` as the process found them, and
    what it computes with."""
    digest = hashlib.sha256()
    for name in _PACKAGES[: _PACKAGES.index(package) + 1]:
        for path in sorted((_ROOT / name).rglob("*")):
            place = path.relative_to(_ROOT).as_posix()
            if path.suffix in (".py", ".toml", ".json") and not place.startswith(_SHOWN_ONLY):
                digest.update(place.encode() + b"\0" + path.read_bytes())
    return {
        "version": birthsim_env.__version__, "sources": digest.hexdigest(), "python": platform.python_version(),
        "numpy": numpy.__version__, "numba": numba.__version__, "scipy": scipy.__version__,
    }  # fmt: skip


def run_tasks(
    tasks: Sequence[Task], folder: Path, jobs: int, title: str, cluster: str | None = None
) -> tuple[dict[str, Result], dict[str, str]]:
    """Results by name, and what went wrong by name, of the tasks that ``folder`` does not hold yet and of those it does.

    A piece is taken from the folder where its settings and ``code_stamp`` are those of now; the screen says how many are.
    ``jobs`` processes work side by side, or those of a ``cluster``, as ``side_by_side`` says. Other processes, also of other
    hosts on a shared disk, may work on the same folder: what one has claimed the others wait for. An interrupt keeps the
    complete pieces.
    """
    results: dict[str, Result] = {}
    failures: dict[str, str] = {}
    begun: list[Task] = []
    paths = {task.name: folder / task.file() for task in tasks}
    with Claims() as claims:
        for task in tasks:
            claims.tidy(paths[task.name])
            if (result := _read(paths[task.name])) is not None:
                results[task.name] = result
        missing = deque(task for task in tasks if task.name not in results)
        _say_what_is_there(title, tasks, results, folder)
        with tqdm(total=len(tasks), initial=len(results), desc=title, unit="piece", disable=not missing) as bar:

            def pieces() -> Iterator[tuple[Task, Path] | None]:
                while missing:
                    begun_before, kept_before = len(begun), len(results)
                    for _ in range(len(missing)):
                        task = missing.popleft()
                        path = paths[task.name]
                        mine = claims.take(path)
                        # Complete by now, before or after the claim: another process has computed it.
                        if (result := _read(path)) is not None:
                            results[task.name] = result
                            bar.update()
                            if mine:
                                claims.give_up(path)
                        elif mine:
                            begun.append(task)
                            yield task, path.with_suffix("")
                        else:
                            missing.append(task)
                    if missing and (len(begun), len(results)) == (begun_before, kept_before):
                        bar.set_postfix_str(f"{len(missing)} at work elsewhere")
                        yield None

            def take(number: int, outcome: Result | str) -> None:
                task = begun[number]
                path = paths[task.name]
                if isinstance(outcome, dict):
                    # A signal in between would leave a file that the last line does not count.
                    with later_signals():
                        _write(path, task, outcome)
                        # As it would be read: one run gives the same as an interrupted one.
                        results[task.name] = _read(path) or {}
                else:
                    failures[task.name] = outcome
                claims.give_up(path)
                bar.update()

            try:
                side_by_side(_attempt, pieces(), min(jobs, len(missing)), take, cluster)
            except KeyboardInterrupt:
                bar.close()
                print(f"{title}: {len(results)} of {len(tasks)} are complete and kept; the same command goes on")
                raise
    return {task.name: results[task.name] for task in tasks if task.name in results}, failures


def _say_what_is_there(title: str, tasks: Sequence[Task], results: dict[str, Result], folder: Path) -> None:
    if results:
        counts = Counter(task.group for task in tasks if task.name in results)
        listed = ", ".join(f"{group} {count}" for group, count in counts.items())
        print(f"{title}: {len(results)} of {len(tasks)} are there with these settings, rig and code, and are kept: {listed}")
    missing = [task.name for task in tasks if task.name not in results]
    stale = sum(any((folder / name).parent.glob(f"{Path(name).name}-{'?' * 16}.json")) for name in missing)
    if stale:
        print(f"{title}: {stale} are there with other settings, rig or code, and are computed anew")


def _write(path: Path, task: Task, result: Result) -> None:
    content = finite({"code": task.code(), "settings": task.settings, "result": result})
    write_json(path, {**content, "sha256": _digest(content["result"])})


def _read(path: Path) -> Result | None:
    """The result in a file; None where there is none, and where it is not as it was written."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return content["result"] if content["sha256"] == _digest(content["result"]) else None
    except (FileNotFoundError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _digest(result: Result) -> str:
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()


def _attempt(task: Task, place: Path) -> Result | str:
    """The result, or what went wrong in words: one controller that fails must not cost the others' results."""
    try:
        return task.work(**task.settings, **({"place": str(place)} if task.keeps else {}))
    except Exception as error:
        return f"{type(error).__name__}: {error}"
