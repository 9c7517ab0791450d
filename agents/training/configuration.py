"""What a training is: its settings, and the files that hold them, one per scenario."""

from __future__ import annotations

import math
import tomllib
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from agents.residual.settings import ResidualSettings
from birthsim_env.assembly import one_of
from birthsim_env.parts.sensors import SENSORS

ALGORITHMS = ("ppo", "sac", "tqc")

FOLDER = Path(__file__).resolve().parent.parent / "configurations"


S = TypeVar("S", "TrainingSettings", ResidualSettings)


@dataclass(frozen=True)
class TrainingSettings:
    """An experiment and its algorithm. ``rollout``, ``epochs`` and ``gae_lambda`` are PPO's; ``gradient_steps``, per step of
    all lanes, are SAC's and TQC's. The learning rate falls linearly to a hundredth. The training ends early once its policy is
    ``until`` percent below the paper's law in validation, pooled settled error; with 100 it never does. Raises ``ValueError``
    naming what cannot be.
    """

    environment: str = "BirthSIM/CircleResidual-v1"
    algorithm: str = "ppo"
    steps: int = 3_000_000
    seed: int = 0
    sensors: str = "ideal"
    randomize: bool | str = True
    lanes: int = 256
    rollout: int = 16
    batch: int = 2048
    epochs: int = 2
    gradient_steps: int = 4
    learning_rate: float = 1e-3
    discount: float = 0.96
    gae_lambda: float = 0.95
    log_std: float = -1.5
    hidden: tuple[int, ...] = (64, 64)
    validation_lanes: int = 64
    validations: int = 6
    until: float = 100.0

    def __post_init__(self) -> None:
        for name, allowed in (
            ("algorithm", ALGORITHMS), ("sensors", tuple(SENSORS)), ("randomize", (False, True, "plant", "scenario")),
        ):  # fmt: skip
            one_of(name, getattr(self, name), allowed)
        if not isinstance(self.environment, str):
            raise ValueError(f"environment = {self.environment!r}; allowed: the id of a residual environment")
        for name in ("steps", "lanes", "rollout", "batch", "epochs", "gradient_steps", "validation_lanes", "validations"):
            if not _whole(getattr(self, name), 1):
                raise ValueError(f"{name} = {getattr(self, name)!r}; allowed: a whole number above 0")
        if not _whole(self.seed, 0):
            raise ValueError(f"seed = {self.seed!r}; allowed: a whole number from 0 on")
        for name, high in (("learning_rate", math.inf), ("discount", 1.0), ("gae_lambda", 1.0)):
            value = getattr(self, name)
            if not (_finite(value) and 0 < value <= high):
                raise ValueError(f"{name} = {value!r}; allowed: a positive number{'' if high == math.inf else ' up to 1'}")
        if not (_finite(self.until) and 0 < self.until <= 100):
            raise ValueError(f"until = {self.until!r}; allowed: above 0 and up to 100 (%)")
        if not _finite(self.log_std):
            raise ValueError(f"log_std = {self.log_std!r}; allowed: a finite number")
        if not isinstance(self.hidden, tuple) or not self.hidden or not all(_whole(width, 1) for width in self.hidden):
            raise ValueError(f"hidden = {self.hidden!r}; allowed: whole numbers above 0")

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return {**asdict(self), "hidden": list(self.hidden)}


def _whole(value: Any, least: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def _finite(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def configuration_names() -> list[str]:
    """The configurations that come with the package."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load_configuration(name: str | Path) -> tuple[TrainingSettings, ResidualSettings]:
    """Settings from a TOML file with tables ``[training]`` and ``[residual]``, or from one that comes with the package.

    Raises ``ValueError`` naming the file and what it has that is unknown.
    """
    path = FOLDER / f"{name}.toml" if str(name) in configuration_names() else Path(name)
    if not path.is_file():
        raise ValueError(f"configuration {str(name)!r} is no file; allowed: {', '.join(configuration_names())}, or a TOML file")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"configuration {str(path)!r} is no TOML: {error}") from error
    for table in content:
        if table not in ("training", "residual"):
            raise ValueError(f"configuration {str(path)!r}: table {table!r}; allowed: training, residual")
        if not isinstance(content[table], dict):
            raise ValueError(f"configuration {str(path)!r}: {table} = {content[table]!r}; allowed: a table [{table}]")
    training, residual = content.get("training", {}), content.get("residual", {})
    if isinstance(training.get("hidden"), list):
        training["hidden"] = tuple(training["hidden"])
    try:
        return override(TrainingSettings(), **training), override(ResidualSettings(), **residual)
    except ValueError as error:
        raise ValueError(f"configuration {str(path)!r}: {error}") from error


def override(settings: S, **values: Any) -> S:
    """``settings`` with other values; raises ``ValueError`` for names that they have not."""
    known = [field.name for field in fields(settings)]
    for name in values:
        if name not in known:
            raise ValueError(f"{name} = {values[name]!r} is unknown; allowed: {', '.join(known)}")
    return replace(settings, **values)
