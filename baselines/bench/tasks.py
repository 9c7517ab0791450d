"""Long work in pieces: each is written as soon as it is complete, and taken from there when the same is asked for again."""

from __future__ import annotations

import hashlib
import json
import platform
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy
import scipy
from tqdm import tqdm

import birthsim_env
from baselines.files import write_json
from baselines.side_by_side import side_by_side

_ROOT = Path(__file__).resolve().parent.parent.parent
_SHOWN_ONLY = (
    *("birthsim_env/drawing", "birthsim_env/drawing/rendering.py", "baselines/commands", "baselines/figures/runs.py"),
    *("baselines/bench/statistics.py", "baselines/bench/comparison_tables.py", "baselines/figures/comparison.py"),
    *("baselines/figures/studies.py", "birthsim_env/scores.json"),
)
"""Sources that show results and do not make them: pieces outlive a change of theirs."""

Result = dict[str, Any]


@dataclass(frozen=True)
class Task:
    """One piece: ``work(**settings)`` of a module's function gives its result; settings and result are JSON.

    ``name`` is its file below the folder, without suffix; ``group`` is what the screen counts it under.
    """

    name: str
    group: str
    work: Callable[..., Result]
    settings: dict[str, Any]


@cache
def code_stamp() -> dict[str, str]:
    """What computes: the package's version, a hash of its sources as the process found them, and what it computes with."""
    digest = hashlib.sha256()
    for package in ("birthsim_env", "baselines"):
        for path in sorted((_ROOT / package).rglob("*")):
            place = path.relative_to(_ROOT).as_posix()
            if path.suffix in (".py", ".toml", ".json") and not place.startswith(_SHOWN_ONLY):
                digest.update(place.encode() + b"\0" + path.read_bytes())
    return {
        "version": birthsim_env.__version__, "sources": digest.hexdigest(), "python": platform.python_version(),
        "numpy": numpy.__version__, "numba": numba.__version__, "scipy": scipy.__version__,
    }  # fmt: skip


def run_tasks(tasks: Sequence[Task], folder: Path, jobs: int, title: str) -> tuple[dict[str, Result], dict[str, str]]:
    """Results by name, and what went wrong by name, of the tasks that ``folder`` does not hold yet and of those it does.

    A piece is taken from the folder where its settings and ``code_stamp`` are those of now; the screen says how many are.
    ``jobs`` processes work side by side; with one, this process works itself. An interrupt keeps the complete pieces.
    """
    stamp, results, missing, stale = code_stamp(), {}, [], 0
    for task in tasks:
        content = _read(folder / f"{task.name}.json")
        if content is not None and content.get("code") == stamp and content.get("settings") == task.settings:
            results[task.name] = content["result"]
        else:
            missing.append(task)
            stale += content is not None
    if results:
        counts = Counter(task.group for task in tasks if task.name in results)
        listed = ", ".join(f"{group} {count}" for group, count in counts.items())
        print(f"{title}: {len(results)} of {len(tasks)} are there with these settings, rig and code, and are kept: {listed}")
    if stale:
        print(f"{title}: {stale} are there with other settings, rig or code, and are computed anew")
    failures: dict[str, str] = {}
    with tqdm(total=len(tasks), initial=len(results), desc=title, unit="piece", disable=not missing) as bar:

        def take(number: int, outcome: Result | str) -> None:
            task = missing[number]
            if isinstance(outcome, dict):
                content = {"code": stamp, "settings": task.settings, "result": outcome}
                (folder / task.name).parent.mkdir(parents=True, exist_ok=True)
                write_json(folder / f"{task.name}.json", content)
                # As it would be read: one run gives the same as an interrupted one.
                results[task.name] = json.loads((folder / f"{task.name}.json").read_text(encoding="utf-8"))["result"]
            else:
                failures[task.name] = outcome
            bar.update()

        side_by_side(_attempt, [(task,) for task in missing], jobs, take)
    return results, failures


def _read(path: Path) -> dict[str, Any] | None:
    """The file's content; None where there is none or it is no piece."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    return content if isinstance(content, dict) and "result" in content else None


def _attempt(task: Task) -> Result | str:
    """The result, or what went wrong in words: one controller that fails must not cost the others' results."""
    try:
        return task.work(**task.settings)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
