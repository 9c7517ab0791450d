"""Names of what a sweep varies, what each may be, and which of them belong together."""

from collections.abc import Collection
from dataclasses import fields
from typing import Any

from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings
from birthsim_env.assembly import one_of
from birthsim_env.parts.drawn.randomization import RANDOMIZE
from birthsim_env.physics.rig.values import in_line, shown
from birthsim_env.registry import names

NAMES = ("environment", "controller", "policy", "sensors", "randomize", "reference", "user_force", "train")
"""What may vary as a whole."""

GROUPS = {
    "rig": "a parameter of the rig as it is",
    "believed": "one of the rig as its controller believes it, and as it is unless [rig] says otherwise",
    "gain": "an option of the controller",
    "training": "a setting of the training",
    "residual": "what the residual may do",
}
"""First part of a dotted name -> what the rest is."""

FIXED = {"episodes": 32, "seed": 0, "parameters": None}
"""What only [base] may have, and its default: episodes a point, the seed of the first, and a TOML file of the believed rig."""

_CHOICES: dict[str, tuple[Any, ...]] = {"sensors": tuple(names("sensors")), "randomize": RANDOMIZE}
_SETTINGS = {"training": TrainingSettings, "residual": ResidualSettings}


def check_name(name: str) -> None:
    """``ValueError`` unless something of this name may vary."""
    group, dot, rest = name.partition(".")
    if name not in NAMES and not (group in GROUPS and dot and rest):
        groups = ", ".join(f'"{group}.NAME"' for group in GROUPS)
        raise ValueError(f"{shown(name)}; allowed: {', '.join(NAMES)}, {groups}; in [base] also {', '.join(FIXED)}")
    known = [field.name for field in fields(_SETTINGS[group])] if group in _SETTINGS else [rest]
    if rest not in known:
        raise ValueError(f"{shown(name)}; allowed after {group!r}: {', '.join(known)}")


def check_value(name: str, value: Any) -> None:
    """``ValueError`` unless ``name``, a known one, may be ``value``; who uses a number checks its size."""
    if name in _CHOICES:
        one_of(name, value, _CHOICES[name])
    elif name in NAMES and not (isinstance(value, str) and value):
        raise ValueError(f"{name} = {shown(value)}; allowed: a word")
    elif name not in NAMES and name != "training.hidden" and not isinstance(value, (str, int, float)):
        raise ValueError(f"{in_line(name)} = {shown(value)}; allowed: a number, a word, true or false")


def check_together(names: Collection[str], controllers: Collection[str]) -> None:
    """``ValueError`` where one of ``names`` would say nothing beside the others; ``controllers`` are those asked for."""
    trains = "train" in names
    for name in names:
        group = name.partition(".")[0]
        if group in _SETTINGS and not trains:
            raise ValueError(f"{name} without train; allowed: with train, the training that it is a setting of")
        if trains and group in ("controller", "policy", "gain"):
            raise ValueError(f"{name} beside train; allowed: without it, the trained policy is what each point evaluates")
    if "policy" in names and not set(controllers) <= {"residual"}:
        raise ValueError(f"controller = {shown(sorted(controllers))} beside policy; allowed: 'residual', or none")
