"""``birthsim study pools [--cluster ray:ADDRESS]``: what it costs to have pieces computed by other processes."""

from __future__ import annotations

import argparse
import time

from baselines.commands.shared import cluster_name, run
from baselines.work.side_by_side import side_by_side

PIECES, LASTS = 200, 0.05
"""Pieces of a measurement, and s that each lasts."""


def wait(seconds: float) -> None:
    """A piece that lasts and computes nothing, so that only what stands around it costs."""
    time.sleep(seconds)


def seconds(jobs: int, cluster: str | None, lasts: float, pieces: int = PIECES) -> tuple[float, float]:
    """s until the first piece is complete, which is the pool's start, and s per piece after it."""
    ends: list[float] = []
    began = time.perf_counter()
    side_by_side(wait, [(lasts,)] * pieces, jobs, lambda number, result: ends.append(time.perf_counter()), cluster)
    return ends[0] - began, (ends[-1] - ends[0]) / (pieces - 1)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study pools", description=__doc__)
    parser.add_argument("--cluster", type=cluster_name, metavar="ray[:ADDRESS]", help="measured beside joblib's processes")
    run(parser, _measure)


def _measure(arguments: argparse.Namespace) -> None:
    print(f"| two workers | start, s | an empty piece, ms | a piece of {1e3 * LASTS:g} ms, ms | of these over half of it |")
    print("|---|---|---|---|---|")
    for name, cluster in (("joblib", None), ("ray", arguments.cluster)):
        if cluster is not None or name == "joblib":
            start, empty = seconds(2, cluster, 0.0)
            _, lasting = seconds(2, cluster, LASTS)
            row = (f"{start:.2f}", f"{1e3 * empty:.2f}", f"{1e3 * lasting:.1f}", f"{1e3 * (lasting - LASTS / 2):.1f}")
            print(f"| {name} | " + " | ".join(row) + " |")
