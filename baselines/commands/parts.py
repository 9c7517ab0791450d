"""The option ``--set`` of the studies, which argparse still reads."""

from __future__ import annotations

import argparse

from baselines.commands.worlds import with_options as with_options


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
