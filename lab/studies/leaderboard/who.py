"""Who an entry is: what of it was learned, what it senses and is told, and how it was trained."""

from typing import Any

from agents.residual.settings import NO_LAW
from baselines.controller import RESIDUAL
from birthsim.benchmark.contestant import ONNX, PLACES, in_task
from birthsim.benchmark.suites import TASKS
from birthsim_env.registry import names
from lab.engine import information

READS, FINDS = "reader=", "finds_rig=true"
"""In a controller's options: a trained network reads the rig, or it finds the rig out by itself."""


def is_learned(said: dict[str, Any]) -> bool:
    """Whether any of an entry was trained."""
    return any(kind != "controller" for kind in said["kinds"]) or READS in said["given"][0]


def learned(said: dict[str, Any]) -> str:
    """What of an entry was learned."""
    if READS in said["given"][0]:
        return "what reads its rig"
    if not is_learned(said):
        return "no"
    law = settings(said).get("law", NO_LAW)
    return "all of it" if law == NO_LAW else f"a correction of `{law}`"


def settings(said: dict[str, Any]) -> dict[str, Any]:
    """Those of the training of its first run; empty where it says none."""
    return dict((said["training"][0] or {}).get("settings", {}))


def title(name: str, said: dict[str, Any]) -> str:
    """An entry's name, marked where it was learned."""
    return f"{name}{' (learned)' if is_learned(said) else ''}"


def facts(said: dict[str, Any]) -> list[str]:
    """What an entry is told of its rig, whether it learns the mass and whether it senses the hand's force."""
    given, sensors = said["given"][0], sorted({one["sensors"] for one in said["tasks"]})
    name = in_task(given, TASKS[said["tasks"][0]["task"]])
    if name in names("policy"):
        name = f"{RESIDUAL}:{name}"
    rig, mass, force = information.informed_if_registered(name, *sensors)
    own = settings(said)
    if set(said["kinds"]) == {ONNX} and own and own.get("law", NO_LAW) == NO_LAW:  # it has observations alone
        mass, force = "no", "yes" if any(TASKS[one["task"]].force_sensor for one in said["tasks"]) else "no"
    return ["finds it out" if READS in given or FINDS in given else rig, mass, force]


def training(said: dict[str, Any]) -> list[str]:
    """Seeds, million steps and minutes of a training, "-" where there was none or nothing is said."""
    if all(kind == "controller" for kind in said["kinds"]):
        return ["-"] * 3
    known = [one or {} for one in said["training"]]
    return [
        str(len(said["kinds"])),
        _mean([one.get("steps") for one in known], 1e-6),
        _mean([one.get("seconds") for one in known], 1 / 60),
    ]


def covers(said: dict[str, Any]) -> str:
    """How many tasks an entry has, and whether each has a policy of its own."""
    own = ", each scenario its own policy" if PLACES[1] in said["given"][0] else ""
    return f"{len(said['tasks'])} of {len(TASKS)}{own}"


def _mean(values: list[float | None], factor: float) -> str:
    known = [one for one in values if one is not None]
    return f"{factor * sum(known) / len(known):.2g}" if known else "-"
