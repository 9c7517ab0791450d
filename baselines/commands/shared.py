"""What the console commands share."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

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


def policy_of(environment: str) -> str:
    """Name of the policy that comes with the package for an environment id: ``BirthSIM/Forceps-v1`` -> ``forceps``."""
    return environment.removeprefix("BirthSIM/").removesuffix("-v1").lower()


def make_folder(path: Path) -> Path:
    """The folder ``path``, made if it is missing; ``ValueError`` where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise ValueError(f"--out {str(path)!r} is a file; allowed: a folder, or a name for a new one") from None
    except OSError as error:
        raise ValueError(f"--out {str(path)!r} cannot be made ({error.strerror}); allowed: a folder to write to") from error
    return path


def write_json(path: Path, content: Any) -> None:
    """Write JSON as a whole or not at all; a number that is not finite becomes null, for which JSON has no other word."""
    partial = path.with_suffix(path.suffix + ".partial")
    partial.write_text(json.dumps(finite(content), indent=1, allow_nan=False), encoding="utf-8")
    partial.replace(path)


def finite(content: Any) -> Any:
    """``content`` with None for every number that is not finite, at any depth."""
    if isinstance(content, dict):
        return {name: finite(value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
