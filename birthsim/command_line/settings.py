"""Types of the settings that commands share: each has its range or choices, its help and its group.

The settings of a command are a dataclass. Its docstring says what the command does; every field is an option of the command
line and a key of ``--config``, and the text below a field is its help. This module imports nothing that is slow to load, so
that help comes at once.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter, Token

if TYPE_CHECKING:
    from baselines.identification.log.log_columns import LogOptions

MOST = 10**9
"""Largest whole number that an option takes, where it has no lower limit of its own."""

EPISODES, JOBS_AT_MOST = 1_000_000, 256
"""Most episodes of an evaluation, some 2 kB each, and most processes side by side."""

LARGEST_SEED = 2**32 - 1
"""Largest seed that an option takes."""

JOBS = 2
"""Processes side by side, unless --jobs says otherwise."""

WORLD, CONTROL, PROCESSES = map(Group.create_ordered, ("World", "Controller", "Processes"))
"""Groups of options in a command's help."""


def whole(least: int = 1, most: int = MOST) -> Parameter:
    """An option's whole number from ``least`` to ``most``, in decimal digits."""

    def read(_: type, tokens: Sequence[Token]) -> int:
        text = tokens[0].value
        if not _is_whole(text, least, most):
            raise ValueError(f"{text[:40]!r}; allowed: a whole number from {least} to {most}")
        return int(text)

    return Parameter(converter=read, metavar=f"{least}..{most}")


def _is_whole(text: str, least: int, most: int) -> bool:
    """Whether it is a whole number in these limits; digits of other scripts are decimal too, more than 20 of any too many."""
    return text.isascii() and text.isdecimal() and len(text) <= 20 and least <= int(text) <= most


def number(unit: str, above: float = -math.inf, most: float = math.inf, least: float = -math.inf) -> Parameter:
    """An option's finite number in ``unit``, more than ``above``, at least ``least`` and at most ``most``."""
    bounds = {"> ": above, ">= ": least, "<= ": most}
    limits = [f"{sign}{bound:g}" for sign, bound in bounds.items() if math.isfinite(bound)]

    def read(_: type, tokens: Sequence[Token]) -> float:
        text = tokens[0].value
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and above < value and least <= value <= most):
            raise ValueError(f"{text[:40]!r}; allowed: {' '.join(['a finite number', ' and '.join(limits)]).rstrip()}")
        return value

    return Parameter(converter=read, metavar=unit)


def read_world_seed(_: type, tokens: Sequence[Token]) -> int:
    """A seed in decimal digits, or the first one of the split that is named."""
    from birthsim_env.splits import SPLITS  # loads what reads a rig

    text = tokens[0].value
    if text in SPLITS:
        return SPLITS[text].first
    if not _is_whole(text, 0, LARGEST_SEED):
        raise ValueError(f"{text[:40]!r}; allowed: a whole number from 0 to {LARGEST_SEED}, or {', '.join(SPLITS)}")
    return int(text)


def check_cluster(_: type, name: str | None) -> None:
    """``ray`` or ``ray:ADDRESS``."""
    kind, colon, address = (name or "ray").partition(":")
    if kind != "ray" or (colon and not address):
        raise ValueError("allowed: ray, or ray:ADDRESS of a running cluster, as ray:10.0.0.1:6379")


def named(kind: str, *more: str) -> Callable[[type, Any], None]:
    """A validator of names, or of lists of them, that are registered under a ``kind`` or are one of ``more``."""

    def check(_: type, given: Any) -> None:
        from birthsim_env.registry import entry  # loads what it looks among

        for name in given if isinstance(given, list) else [given]:
            if name is not None and name not in more:
                entry(kind, name, "".join(f", {one}" for one in more))

    return check


ENV = Parameter(group=WORLD, metavar="ID")
Env = Annotated[str, ENV, Parameter(help="Environment.")]
Seed = Annotated[int, whole(0, LARGEST_SEED)]
"""A seed that NumPy and PyTorch take."""
WorldSeed = Annotated[int, Parameter(converter=read_world_seed, metavar="SEED")]
"""The seed of the first world, or the name of a split, which begins with it."""

SENSORS = Parameter(group=WORLD, metavar="NAME", validator=named("sensors"))
ALGORITHM = Parameter(metavar="NAME", validator=named("algorithm"))
Sensors = Annotated[str, SENSORS, Parameter(help="Sensor model, one of the sensors listed below.")]
FRICTION = Parameter(group=WORLD, metavar="NAME", validator=named("friction"))
Friction = Annotated[
    str,
    FRICTION,
    Parameter(help="What the friction of rigs is drawn from, one of the frictions listed below. [default: the rig's]"),
]
Randomize = Annotated[Literal["none", "plant", "scenario", "sensors", "all"], Parameter(group=WORLD)]
RigFile = Annotated[str | None, Parameter(group=WORLD, metavar="FILE", help="TOML file of the rig. [default: the paper's rig]")]
Style = Annotated[
    Literal["screen", "paper"],
    Parameter(help="Figures for a screen (PNG and SVG) or for a paper (PDF: a column wide, letters of 8 pt, no titles)."),
]


def require_folder(style: str, folder: Path | None, option: str) -> None:
    """Raise ``ValueError`` where a ``style`` is asked for and no ``folder`` for figures, which ``option`` names."""
    if style != "screen" and folder is None:
        raise ValueError(f"--style {style} is given; allowed with --{option} FOLDER only")


MANY = Parameter(consume_multiple=True)
"""An option takes several values."""
CONTROLLER = Parameter(group=CONTROL, metavar="NAME")
HAND = Parameter(group=WORLD, metavar="PART")
TABLE = Parameter(metavar="TABLE")
NAMES = "the controllers listed below, with options as in 'admittance[learn=false]', or path/to/file.py:Class."
"""Help of an option that names controllers."""
Controller = Annotated[str, CONTROLLER, Parameter(help=f"One of {NAMES}")]
Controllers = Annotated[
    list[str] | None,
    MANY,
    CONTROLLER,
    Parameter(alias="--controllers", metavar="NAME...", help=f"One or more of {NAMES}"),
]
Set = Annotated[
    list[str],
    MANY,
    Parameter(
        group=CONTROL,
        metavar="GAIN=VALUE...",
        help="Gains and other options, such as bandwidth=60, for every named controller that has them; for only one of them "
        "write 'pid[bandwidth=60]' as its name.",
    ),
]

RANDOMIZE: dict[str, bool | str] = {"none": False, "plant": "plant", "scenario": "scenario", "sensors": "sensors", "all": True}
"""``Randomize`` -> the environments' argument ``randomize``."""


@dataclass(kw_only=True)
class Configured:
    """What every command with options has."""

    config: Annotated[Path | None, Parameter(metavar="FILE")] = None
    """TOML file with these options, one "name = value" per line; the command line takes precedence."""

    def shown(self) -> dict[str, Any]:
        """What results depend on, as JSON."""
        return {
            name: value if value is None or isinstance(value, bool | int | list) else str(value)
            for name, value in vars(self).items()
            if name not in ("out", "jobs", "cluster", "config")
        }


@dataclass(kw_only=True)
class Logged(Configured):
    """How a laboratory's log is read."""

    columns: Annotated[str | None, Parameter(metavar="NAME=COLUMN,...")] = None
    """What the columns of the log are called, such as force_x=Fz,force_y=none, or opening=u*0.2-1 for a column in volts."""
    skip: Annotated[int | None, whole(0)] = None
    """Number of lines before the heading of the log, if it is not found automatically."""
    decimal_comma: bool = False
    """The log has decimal commas."""

    def options(self) -> "LogOptions":
        """The same for what reads logs."""
        from baselines.identification.log.log_columns import LogOptions  # loads NumPy

        return LogOptions(self.columns or "", self.skip, self.decimal_comma)


@dataclass(kw_only=True)
class Parts(Configured):
    """Parts of a user's own, instead of the environment's."""

    reference: Annotated[
        str | None,
        Parameter(
            group=WORLD,
            metavar="PART",
            help="What the head follows: a CSV file of time, x, y (s, m, m), FILE:t,a,b if its columns have these names, or "
            "path/to/file.py:Name of a birthsim_env.Trajectory or of a function of time that returns (x, y).",
        ),
    ] = None
    stiffness: Annotated[str | None, Parameter(group=WORLD, metavar="FILE")] = None
    """Stiffness setpoints: a CSV file of time, x, y, stiffness (s, m, m, N/m), which --reference takes too."""
    user_force: Annotated[
        str | None,
        HAND,
        Parameter(
            help="The hand: one of the hands listed below, a CSV file of time, Fx, Fy (s, N, N), or path/to/file.py:Name of a "
            "birthsim_env.UserForce or of a function of time that returns (Fx, Fy).",
        ),
    ] = None

    def parts(self) -> dict[str, Any]:
        """The environments' arguments, as far as they are given."""
        given = {"reference": self.reference, "stiffness": self.stiffness, "user_force": self.user_force}
        return {name: part for name, part in given.items() if part is not None}


@dataclass(kw_only=True)
class Processes(Configured):
    """Where work is done."""

    jobs: Annotated[int, whole(1, JOBS_AT_MOST), Parameter(group=PROCESSES)] = JOBS
    """Number of processes that work in parallel."""
    cluster: Annotated[str | None, Parameter(group=PROCESSES, metavar="ray[:ADDRESS]", validator=check_cluster)] = None
    """Use the workers of Ray instead, of a running cluster or of this machine."""
