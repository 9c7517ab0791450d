"""The table of a log, as any other table is read."""

from pathlib import Path

from birthsim_env.tables import reading
from birthsim_env.tables.table import Reading, Table


def read_table(path: Path, how: Reading | None = None) -> Table:
    """The table of a log; ``ValueError`` names the file and what is wrong with it."""
    return reading.read_table("log", path, how)
