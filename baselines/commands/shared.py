"""Options of the commands that argparse still reads: studies and the page. It has under one name what they import."""

from __future__ import annotations

import argparse
import math
import tomllib
from collections.abc import Callable
from typing import Any

from baselines.commands.command import act
from baselines.commands.settings import EPISODES as EPISODES
from baselines.commands.settings import JOBS as JOBS
from baselines.commands.settings import JOBS_AT_MOST, MOST
from baselines.commands.worlds import policy_of as policy_of
from birthsim_env.physics.rig.values import near, shown


def run(parser: argparse.ArgumentParser, action: Callable[[argparse.Namespace], None]) -> None:
    """Parse, and act as ``command.act`` does."""
    arguments = _parsed(parser)
    act(parser.prog, lambda: action(arguments))


def _parsed(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """What the command line says, over what ``--config`` says in TOML; an unknown option is asked about."""
    options = {option: action for action in parser._actions for option in action.option_strings}
    if "--config" not in options:  # a training's configuration is its own
        parser.add_argument(
            "--config", metavar="FILE", help="TOML file of options, as episodes = 64; what is typed counts more"
        )
        first = argparse.ArgumentParser(parser.prog, add_help=False, allow_abbrev=False)
        first.add_argument("--config", nargs="?")
        path = first.parse_known_args()[0].config
        if path is not None:
            _configure(parser, path, options)
    arguments, unknown = parser.parse_known_args()
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}{near(unknown[0], options)}")
    return arguments


def _configure(parser: argparse.ArgumentParser, path: str, options: dict[str, argparse.Action]) -> None:
    """Take the options of a TOML file as the parser's defaults."""
    try:
        with open(path, "rb") as file:
            said = tomllib.load(file)
    except (OSError, ValueError) as error:
        parser.error(f"--config {path!r} cannot be read: {error}")
    for name, value in said.items():
        option = f"--{name.replace('_', '-')}"
        if option not in options or option == "--help":
            allowed = ", ".join(known[2:] for known in options if known.startswith("--") and known != "--help")
            parser.error(f"--config {path!r}: {shown(name)}{near(option[2:], allowed.split(', '))}; allowed: {allowed}")
        action = options[option]
        values = value if isinstance(value, list) else [value]
        many, count = action.nargs not in (None, 0), 1 if action.nargs is None else action.nargs
        fits = isinstance(value, bool) if count == 0 else not isinstance(value, bool | dict) and count in (len(values), "+")
        if not fits or (action.choices is not None and not {*map(str, values)} <= {*map(str, action.choices)}):
            allowed = "true or false" if action.nargs == 0 else ", ".join(map(str, action.choices or ["what the option takes"]))
            parser.error(f"--config {path!r}: {name} = {shown(value)}; allowed: {allowed}")
        # argparse reads a default that is text as it reads the command line.
        action.default = value if action.nargs == 0 else [*map(str, values)] if many else str(value)
        action.required = False


def whole_up_to(most: int) -> Callable[[str], int]:
    """A whole number from 1 to ``most``, for argparse."""

    def whole_number(text: str) -> int:
        # Digits of other scripts are decimal too; more than 20 of any are too many.
        if not (text.isascii() and text.isdecimal() and len(text) <= 20 and 1 <= int(text) <= most):
            raise argparse.ArgumentTypeError(f"{shown(text)}; allowed: a whole number >= 1 and <= {most}")
        return int(text)

    return whole_number


whole = whole_up_to(MOST)
"""A whole number from 1 to ``MOST``, for argparse."""


def finite_number(text: str) -> float:
    """A finite number, for argparse."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"{shown(text)}; allowed: a finite number")
    return number


def cluster_name(text: str) -> str:
    """``ray`` or ``ray:ADDRESS``, for argparse."""
    kind, colon, address = text.partition(":")
    if kind != "ray" or (colon and not address):
        raise argparse.ArgumentTypeError(f"{text!r}; allowed: ray, or ray:ADDRESS of a running cluster, as ray:10.0.0.1:6379")
    return text


def seed_number(text: str) -> int:
    """A seed that NumPy and PyTorch take, for argparse."""
    if not (text.isascii() and text.isdecimal() and len(text) <= 20 and int(text) < 2**32):
        raise argparse.ArgumentTypeError(f"{shown(text)}; allowed: a whole number from 0 to {2**32 - 1}")
    return int(text)


def add_processes(parser: argparse.ArgumentParser) -> None:
    """Add ``--jobs`` and ``--cluster``."""
    parser.add_argument("--jobs", type=whole_up_to(JOBS_AT_MOST), help=f"processes side by side (default: {JOBS})")
    parser.add_argument(
        "--cluster",
        type=cluster_name,
        metavar="ray[:ADDRESS]",
        help="Ray's workers instead, of a running cluster or of this machine",
    )


def shown_arguments(arguments: argparse.Namespace) -> dict[str, Any]:
    """The arguments that results depend on, as JSON."""
    without = ("out", "jobs", "cluster", "config")
    return {
        key: value if value is None or isinstance(value, (bool, int, list)) else str(value)
        for key, value in vars(arguments).items() if key not in without
    }  # fmt: skip
