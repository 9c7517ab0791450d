"""What the teaching of a reader is asked for."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from birthsim_env.assembly import one_of
from birthsim_env.physics.rig.reading import read_toml
from birthsim_env.physics.rig.values import checked_count, checked_number, in_line, near, path_of, shown
from birthsim_env.registry import names

TABLE = "reader"
"""Of a configuration that teaches a reader."""

CONFIGURATIONS = Path(__file__).resolve().parent / "configurations"
"""Those that come with the package."""

COUNTS = {
    "seed": (0, 2**32 - 1), "rounds": (1, 100), "lanes": (2, 2**16), "updates": (1, 10**6), "batch": (1, 2**16),
    "hidden": (1, 512),
}  # fmt: skip
"""Least and largest of what is counted."""


@dataclass(frozen=True)
class ReaderSettings:
    """A reader: ``hidden`` cells of its memory, taught with ``updates`` of a gradient by Adam, each on ``batch`` episodes.

    Episodes are collected in ``rounds`` of ``lanes`` rigs each, with ``sensors``; ``scenarios`` and ``frictions``
    (``parts.drawn.frictions``; "" for that of the rig as described) take turns from round to round. ``learning_rate`` falls
    linearly to a fiftieth. Raises ``ValueError`` naming what cannot be.
    """

    seed: int = 0
    sensors: str = "honest"
    scenarios: tuple[str, ...] = ("circle", "circle", "probe")
    frictions: tuple[str, ...] = ("", "drawn")
    rounds: int = 18
    lanes: int = 256
    updates: int = 1000
    batch: int = 64
    hidden: int = 32
    learning_rate: float = 3e-3

    def __post_init__(self) -> None:
        one_of("sensors", self.sensors, tuple(names("sensors")))
        for name, kind, more in (("scenarios", "scenario", ()), ("frictions", "friction", ("",))):
            chosen, allowed = getattr(self, name), (*more, *names(kind))
            if not isinstance(chosen, (tuple, list)) or not chosen:
                raise ValueError(f"{name} = {shown(chosen)}; allowed: a list of {', '.join(map(repr, allowed))}")
            for one in chosen:
                one_of(name, one, allowed)
            object.__setattr__(self, name, tuple(chosen))
        for name, (few, many) in COUNTS.items():
            object.__setattr__(self, name, checked_count(name, getattr(self, name), few, many))
        checked_number("learning_rate", self.learning_rate, "-", above=0.0, most=1.0)
        if self.batch > self.lanes:
            raise ValueError(f"batch = {self.batch}; allowed: at most lanes = {self.lanes}, the episodes of a round")

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return {**asdict(self), "scenarios": list(self.scenarios), "frictions": list(self.frictions)}


def reader_configurations() -> list[str]:
    """The configurations of readers that come with the package."""
    return sorted(path.stem for path in CONFIGURATIONS.glob("*.toml"))


def _path(config: str | os.PathLike[str]) -> Path:
    text = path_of(config) or ""
    return CONFIGURATIONS / f"{text}.toml" if text in reader_configurations() else Path(text)


def is_reader(config: str | os.PathLike[str]) -> bool:
    """Whether a configuration, by name or file, teaches a reader: it has a table ``[reader]``."""
    path = _path(config)
    return os.path.isfile(path) and TABLE in read_toml("configuration", path)


def load_reader_settings(config: str | os.PathLike[str], **changes: Any) -> ReaderSettings:
    """The settings of a configuration for which ``is_reader`` holds, with other values; ``ValueError`` names what cannot be."""
    content, path = read_toml("configuration", _path(config)), str(_path(config))
    for table in content:
        if table != TABLE or not isinstance(content[table], dict):
            raise ValueError(
                f"configuration = {path!r}: {in_line(table)} = {shown(content[table])}; allowed: a table [{TABLE}]"
            )
    known = [field.name for field in fields(ReaderSettings)]
    for given, where in ((content[TABLE], f"configuration = {path!r}: "), (changes, "")):
        for name, value in given.items():
            if name not in known:
                raise ValueError(f"{where}{in_line(name)} = {shown(value)}{near(name, known)}; allowed: {', '.join(known)}")
    try:
        settings = ReaderSettings(**content[TABLE])
    except ValueError as error:
        raise ValueError(f"configuration = {path!r}: {error}") from error
    return replace(settings, **changes)
