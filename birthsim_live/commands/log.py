"""birthsim export: a recording or an evaluation as Parquet or MCAP, with units."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baselines.commands.settings import Configured
from baselines.logs.writing import WRITERS, write_log
from birthsim_live.logs.reading import read_log


@dataclass(kw_only=True)
class Settings(Configured):
    """Write a recording of birthsim live, an evaluation, or the traces in a piece of one, as Parquet or as MCAP (PlotJuggler,
    Foxglove). Columns have units.
    """

    file: Path = field(kw_only=False)
    """A recording, .rec; evaluation.json; a piece of an evaluation, .json."""
    to: Annotated[str, Parameter(choices=tuple(suffix[1:] for suffix in WRITERS))]
    """Form of the file."""
    out: Path
    """File to write, with the form as its ending."""


def main(settings: Settings) -> None:
    """Write the file and count its rows."""
    if settings.out.suffix != f".{settings.to}":
        raise ValueError(f"--out {str(settings.out)!r}; allowed: a file that ends in .{settings.to}")
    log = read_log(settings.file)
    write_log(log, settings.out)
    rows = sum(len(one.times) for one in log.series)
    print(f"written to {settings.out}: {rows} rows of {len(log.columns)} columns, {len(log.events)} events")
