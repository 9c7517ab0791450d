"""``--to parquet, mcap``: a recording or an evaluation as Parquet or MCAP, with units."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baselines.logs.writing import WRITERS, write_log
from birthsim.command_line.settings import Configured
from birthsim.exports import Form
from birthsim_env.physics.rig.reading import named
from birthsim_env.registry import register
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
        raise ValueError(f"--out {named(settings.out)}; allowed: a file that ends in .{settings.to}")
    log = read_log(settings.file)
    write_log(log, settings.out)
    rows = sum(len(one.times) for one in log.series)
    print(f"written to {settings.out}: {rows} rows of {len(log.columns)} columns, {len(log.events)} events")


register(export="parquet", about="a recording or an evaluation, as a table", order=40)(
    Form(Settings, main, "run.rec --out run.parquet")
)
register(export="mcap", about="a recording or an evaluation, for PlotJuggler", order=41)(
    Form(Settings, main, "run.rec --out run.mcap")
)
