"""Options of the commands for parts of a user's own: reference, hand, and the gains of controllers."""

from __future__ import annotations

import argparse
from typing import Any

from birthsim_env.parts.hands.moving_hands import HANDS


def add_parts(parser: argparse.ArgumentParser) -> None:
    """Add ``--reference``, ``--stiffness`` and ``--user-force``."""
    parser.add_argument(
        "--reference",
        metavar="PART",
        help="your own instead of the environment's: a CSV file of time, x, y (s, m, m), or path/to/file.py:Name of a "
        "birthsim_env.Trajectory or of a function of time that returns (x, y)",
    )
    parser.add_argument(
        "--stiffness",
        metavar="FILE",
        help="setpoints of your own instead of the environment's: a CSV file of time, x, y, stiffness (s, m, m, N/m); "
        "--reference takes the same file",
    )
    parser.add_argument(
        "--user-force",
        metavar="PART",
        help=f"your own hand instead of the environment's: {', '.join(HANDS)}, a CSV file of time, Fx, Fy (s, N, N), or "
        "path/to/file.py:Name of a birthsim_env.UserForce or of a function of time that returns (Fx, Fy)",
    )


def environment_parts(arguments: argparse.Namespace) -> dict[str, Any]:
    """The environments' arguments that ``add_parts`` reads, as far as they are given."""
    parts = {"reference": arguments.reference, "stiffness": arguments.stiffness, "user_force": arguments.user_force}
    return {name: part for name, part in parts.items() if part is not None}


def add_set(parser: argparse.ArgumentParser) -> None:
    """Add ``--set``."""
    parser.add_argument(
        "--set",
        nargs="+",
        action="extend",
        default=[],
        metavar="GAIN=VALUE",
        help="gains and other options of the controllers named, of those that have them, such as --set bandwidth=60; one of "
        "several controllers takes them by name: 'pid[bandwidth=60]'",
    )
