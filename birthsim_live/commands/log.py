"""birthsim export: a recording or an evaluation as Parquet or MCAP, with units."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.shared import run
from baselines.logs.writing import WRITERS, write_log
from birthsim_live.logs.reading import read_log


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim export",
        description="Write a recording of birthsim live, an evaluation, or the traces in a piece of one, as Parquet or as MCAP "
        "(PlotJuggler, Foxglove). Columns have units.",
    )
    parser.add_argument("--to", choices=[suffix[1:] for suffix in WRITERS], required=True, help="the form of the file")
    parser.add_argument("file", type=Path, help="a recording, .rec; evaluation.json; a piece of an evaluation, .json")
    parser.add_argument("--out", type=Path, required=True, help="file to write, with the form as its ending")
    run(parser, _log)


def _log(arguments: argparse.Namespace) -> None:
    if arguments.out.suffix != f".{arguments.to}":
        raise ValueError(f"--out {str(arguments.out)!r}; allowed: a file that ends in .{arguments.to}")
    log = read_log(arguments.file)
    write_log(log, arguments.out)
    rows = sum(len(one.times) for one in log.series)
    print(f"written to {arguments.out}: {rows} rows of {len(log.columns)} columns, {len(log.events)} events")
