"""What the console commands share."""

from __future__ import annotations

import argparse
import json
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
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}; allowed: a whole number >= 1")
    return value


def make_folder(path: Path) -> Path:
    """The folder ``path``, made if it is missing."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def write_json(path: Path, content: Any) -> None:
    """Write JSON as a whole or not at all."""
    partial = path.with_suffix(path.suffix + ".partial")
    partial.write_text(json.dumps(content, indent=1), encoding="utf-8")
    partial.replace(path)
