"""What the console commands share."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

import gymnasium

RANDOMIZE: dict[str, bool | str] = {"none": False, "plant": "plant", "scenario": "scenario", "all": True}
"""The option --randomize -> the environments' argument ``randomize``."""


def run(parser: argparse.ArgumentParser, action: Callable[[argparse.Namespace], None]) -> None:
    """Parse, act, and turn what a user can mend into one line and exit status 2; an interrupt into 130."""
    arguments = parser.parse_args()
    try:
        action(arguments)
    except (ValueError, OSError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    except KeyboardInterrupt:
        print(f"{parser.prog}: interrupted", file=sys.stderr)
        raise SystemExit(130) from None


def whole(text: str) -> int:
    """A whole number >= 1, for argparse."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}; allowed: a whole number >= 1")
    return int(text)


def seed_number(text: str) -> int:
    """A seed that NumPy and PyTorch take, for argparse."""
    if not text.isdecimal() or int(text) >= 2**32:
        raise argparse.ArgumentTypeError(f"{text!r}; allowed: a whole number from 0 to {2**32 - 1}")
    return int(text)


def check_world(environment: str, **arguments: Any) -> None:
    """Raises ``ValueError`` for arguments with which no episode of an environment begins, before anything else is done."""
    env: Any = gymnasium.make(environment, **arguments)
    try:
        env.reset(seed=0)
    finally:
        env.close()


def policy_of(environment: str) -> str:
    """Name of the policy that comes with the package for an environment id: ``BirthSIM/Forceps-v1`` -> ``forceps``."""
    return environment.removeprefix("BirthSIM/").removesuffix("-v1").lower()
