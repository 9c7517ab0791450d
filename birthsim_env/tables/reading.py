"""The one reader of tables: what a file is called says what it is."""

from pathlib import Path

from birthsim_env.extras import installation
from birthsim_env.physics.rig.reading import named, read
from birthsim_env.registry import entry, names
from birthsim_env.tables.table import Reading, Table

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
    """The table of a file whose ending has a registered reader, in any case.

    ``ValueError`` in one line names ``argument``, the file and what is wrong with it. What is wrong with a column is
    said when it is asked for.
    """
    suffix, known = path.suffix.lower(), names("reader")
    if suffix not in known:
        hint = f"; {_HINTS[suffix]}" if suffix in _HINTS else ""
        raise ValueError(f"{argument} = {named(path)}; allowed: a file that ends in {', '.join(known)}{hint}")
    how, reader = how or Reading(), entry("reader", suffix)
    source = f"{argument} = {named(path)}"
    try:
        found: Table = reader.made(source, read(argument, path, how.most), how)
    except ImportError as error:
        extras = [need.removeprefix("extra ") for need in sorted(reader.needs)]
        raise ValueError(f"{source}: {error}; allowed with the extra: {installation(*extras)}") from error
    return found
