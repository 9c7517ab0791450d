"""The one reader of tables: what a file is called says what it is."""

from collections.abc import Callable
from pathlib import Path

from birthsim_env.extras import installation
from birthsim_env.physics.rig.reading import named, read
from birthsim_env.tables.mat_files import read_mat
from birthsim_env.tables.table import Reading, Table
from birthsim_env.tables.text_files import read_text_file

_HINTS = {
    ".xlsx": "save the sheet as CSV",
    ".xls": "save the sheet as CSV",
    ".h5": "export it as Parquet or CSV",
    ".hdf5": "export it as Parquet or CSV",
    ".tdms": "export it as CSV",
    ".npy": "numpy.savetxt(..., delimiter=',', header='time,...') writes CSV",
    ".npz": "numpy.savetxt(..., delimiter=',', header='time,...') writes CSV",
    ".feather": "write it as Parquet",
    ".bag": "export it as MCAP with JSON messages, or as CSV",
    ".gz": "unpack it first",
    ".zip": "unpack it first",
}


def read_table(argument: str, path: Path, how: Reading | None = None) -> Table:
    """The table of a file that ends in one of ``READERS``, in any case.

    ``ValueError`` in one line names ``argument``, the file and what is wrong with it. What is wrong with a column is
    said when it is asked for.
    """
    suffix = path.suffix.lower()
    if suffix not in READERS:
        hint = f"; {_HINTS[suffix]}" if suffix in _HINTS else ""
        raise ValueError(f"{argument} = {named(path)}; allowed: a file that ends in {', '.join(READERS)}{hint}")
    how = how or Reading()
    source = f"{argument} = {named(path)}"
    return READERS[suffix](source, read(argument, path, how.most), how)


def _parquet(source: str, content: bytes, how: Reading) -> Table:
    try:
        from birthsim_env.tables.parquet_files import read_parquet
    except ImportError as error:
        raise _missing(source, error) from error
    return read_parquet(source, content, how)


def _mcap(source: str, content: bytes, how: Reading) -> Table:
    try:
        from birthsim_env.tables.mcap_files import read_mcap
    except ImportError as error:
        raise _missing(source, error) from error
    return read_mcap(source, content, how)


def _missing(source: str, error: ImportError) -> ValueError:
    return ValueError(f"{source}: {error}; allowed with the extra for logs: {installation('log')}")


READERS: dict[str, Callable[[str, bytes, Reading], Table]] = {
    **{".csv": read_text_file, ".parquet": _parquet, ".mcap": _mcap, ".mat": read_mat},
    **dict.fromkeys((".tsv", ".txt", ".lvm"), read_text_file),
}
"""Suffix, in lower case -> what reads a file of it."""
