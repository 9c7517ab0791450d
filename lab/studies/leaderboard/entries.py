"""Entries of the leaderboard: rows that ``birthsim score`` wrote, what they may name, and the rules that they keep.

An entry is lab/leaderboard/NAME.json. It names registered controllers, shipped policies, or files in the folder NAME beside it:
ONNX, or what ``birthsim train`` wrote. Those hold data, so that nothing of an entry is run as code.
"""

import os
import re
import tomllib
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from agents.foreign import onnx_file
from baselines.controller import RESIDUAL
from baselines.named import make_controller, resolved
from birthsim.benchmark.contestant import PLACES, in_task
from birthsim.benchmark.row import LOST
from birthsim.benchmark.scoring import FORMAT
from birthsim.benchmark.suites import TASKS
from birthsim_env import Parameters
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Listed
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import names
from birthsim_env.splits import TEST

ENTRIES = ROOT / "lab" / "leaderboard"
OWN = ENTRIES / "own.toml"
"""The project's own entries, which are made from there."""

RULES: dict[str, Any] = {"format": FORMAT, "split": TEST.name, "seed": TEST.first, "episodes": 64}
"""What every entry has."""

MOST = 2**24
"""Bytes of an entry."""

_VALUE = (float, str, None)
_ESTIMATE = {"value": _VALUE, "low": _VALUE, "high": _VALUE}
_TASK = {
    "task": str, "environment": str, "sensors": str, "episodes": int, "infeasible": Listed(range(RULES["episodes"])),
    "errors": Listed(Listed(_VALUE), 1), "score": _ESTIMATE, "scores": Listed(float, 1), "success": _ESTIMATE,
    "error_mm": _ESTIMATE, "lost": Listed(int, 1), "returns": Listed(float, 1), "seconds": Listed(float, 1),
}  # fmt: skip
_ENTRY = {
    "format": str, "entry": str, "given": Listed(str, 1), "kinds": Listed(str, 1), "split": str, "seed": int, "episodes": int,
    "policy_period": Listed(float, 1), "training": Listed((dict, None), 1), "tasks": Listed(_TASK, 1), "seconds": float,
    "versions": dict,
}  # fmt: skip
_TRAINING = {"settings": dict, "steps": (int, None), "seconds": (float, None)}

_NAME = re.compile(r"[\w-]+")
_BESIDE = re.compile(r"[\w{}-]+(\.onnx)?")
_REGISTERED = re.compile(r"(limited:)?[a-z][\w-]*(\[[\w.,=+-]+\])?")


def entries() -> list[Path]:
    """The files of the entries."""
    return sorted(ENTRIES.glob("*.json"))


def own_entries() -> dict[str, tuple[str, list[str]]]:
    """Name -> policy and tasks of each entry that the project makes itself."""
    return {
        name: (own["policy"], [task for task in TASKS if any(fnmatch(task, pattern) for pattern in own.get("tasks", ["*"]))])
        for name, own in tomllib.loads(OWN.read_text(encoding="utf-8")).items()
    }


def entry(path: Path) -> dict[str, Any]:
    """An entry as it stands; ``ValueError`` names it and what is missing or damaged."""
    if not _NAME.fullmatch(path.stem):
        raise ValueError(f"entry = {shown(path.name)}; allowed: letters, digits, _ and -, and .json")
    said: dict[str, Any] = read_json("entry", path, _ENTRY, MOST)
    for own in said["training"]:
        if own is not None and set(own) != set(_TRAINING):
            raise ValueError(f"entry = {shown(path.name)}: training = {shown(own)}; allowed: null, or {', '.join(_TRAINING)}")
    return said


def against_rules(said: dict[str, Any], path: Path) -> str:
    """What of the entry of a ``path`` the rules do not allow, or ""; nothing that it names is run."""
    for name, allowed in RULES.items():
        if said[name] != allowed or type(said[name]) is not type(allowed):
            return f"{name} = {shown(said[name])}; allowed: {allowed!r}"
    periods = said["policy_period"]
    if len(set(periods)) > 1 or not 0 < periods[0] <= 1:
        return f"policy_period = {shown(periods)}; allowed: the same of every run, above 0 and at most 1 s"
    tasks = [one["task"] for one in said["tasks"]]
    if unknown := [name for name in tasks if name not in TASKS]:
        return f"task = {shown(unknown[0])}; allowed: {', '.join(TASKS)}"
    if len(set(tasks)) < len(tasks):
        return f"tasks = {shown(tasks)}; allowed: each once"
    runs = len(said["kinds"])
    for one in said["tasks"]:
        if [len(run) for run in one["errors"]] != [RULES["episodes"]] * runs or len(one["scores"]) != runs:
            return f"errors of {shown(one['task'])}; allowed: {RULES['episodes']} of each of {runs} runs"
        if words := [error for run in one["errors"] for error in run if isinstance(error, str) and error != LOST]:
            return f"error = {shown(words[0])}; allowed: a number, null or {LOST!r}"
    problems = (_not_allowed(given, task, path) for given in said["given"] for task in tasks)
    return next(filter(None, problems), "")


def policies_of(said: dict[str, Any], path: Path) -> list[str]:
    """What an entry that keeps the rules names, as ``birthsim.score`` takes it."""
    beside = path.with_suffix("")
    return [str(beside / one) if _is_beside(one, said["tasks"][0]["task"], path) else one for one in said["given"]]


def _is_beside(given: str, task: str, path: Path) -> bool:
    """Whether what is named lies in the entry's folder, where nothing registered has its name."""
    return bool(_BESIDE.fullmatch(given)) and in_task(given, TASKS[task]) not in (*names("policy"), *names("controller"))


def _not_allowed(given: str, task: str, path: Path) -> str:
    """What is wrong with what an entry names, in a task, or ""."""
    said = f"given = {shown(given)}"
    name = in_task(given, TASKS[task])
    if name in names("policy"):
        return ""
    if _is_beside(given, task, path):
        place = path.with_suffix("") / name
        inside = [path.with_suffix(""), place, *place.rglob("*")]
        there = os.path.isfile(place) if place.suffix == onnx_file.SUFFIX else os.path.isdir(place)
        if there and not any(one.is_symlink() for one in inside):
            return ""
        return f"{said}; allowed: a file {onnx_file.SUFFIX}, or a folder of birthsim train, in {path.stem}/, and no link"
    registered = [one for one in names("controller") if one != RESIDUAL]
    if not _REGISTERED.fullmatch(name) or any(one in given for one in PLACES) or resolved(name)[0] not in registered:
        return (
            f"{said}; allowed: {', '.join(registered)}, with options as in pid[bandwidth=60]; a shipped policy; FILE.onnx or a "
            f"folder of birthsim train in {path.stem}/"
        )
    try:
        make_controller(name, Parameters())  # which looks at its options
    except ValueError as error:
        return f"{said}: {error}"
    return ""
