"""Tables of named columns from CSV, Parquet and MCAP files, whoever wrote them."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.reading import read
from birthsim_env.physics.rig.values import in_line, problem, shown

LARGEST = 512 * 2**20
"""Bytes of a log; an hour at 1 kHz takes some 400 MB as CSV."""


@dataclass(frozen=True)
class Table:
    """``columns``: name -> (T,) numbers, NaN where a row has none; ``source`` names the file in errors."""

    source: str
    columns: dict[str, Array]

    def column(self, name: str) -> Array:
        """A column; ``ValueError`` names what there is."""
        if name not in self.columns:
            raise ValueError(f"{self.source} has no column {name!r}; there are: {in_line(', '.join(self.columns))}")
        return self.columns[name]


def read_table(path: Path) -> Table:
    """The table of a log; ``ValueError`` names the file and what is wrong with it."""
    if path.suffix not in READERS:
        raise ValueError(f"log = {str(path)!r}; allowed: a file that ends in {', '.join(READERS)}")
    return READERS[path.suffix](path)


def read_csv(path: Path) -> Table:
    """The table of a CSV file whose first line names the columns; lines that begin with # are left out."""
    source = f"log = {str(path)!r}"
    try:
        text = read("log", path, LARGEST).decode("utf-8-sig")
        lines = [
            (number, line)
            for number, line in enumerate(csv.reader(io.StringIO(text, newline="")), start=1)
            if line and not line[0].lstrip().startswith("#")
        ]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{source} is no CSV ({problem(error)})") from error
    if not lines:
        raise ValueError(f"{source} is empty; allowed: a line of names, then lines of numbers")
    names = [name.strip() for name in lines[0][1]]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{source} has two columns {twice!r}; allowed: one of each name")
    rows = np.empty((len(lines) - 1, len(names)))
    for row, (number, line) in zip(rows, lines[1:], strict=True):
        try:
            numbers = [float(value) if value.strip() else np.nan for value in line]
        except ValueError:
            numbers = []
        if len(numbers) != len(names):
            words = f"allowed: {len(names)} numbers, for {', '.join(names)}"
            raise ValueError(f"{source}, line {number}: {shown(','.join(line))}; {in_line(words)}")
        row[:] = numbers
    return Table(source, dict(zip(names, rows.T, strict=True)))


def _read_parquet(path: Path) -> Table:
    source = f"log = {str(path)!r}"
    content = read("log", path, LARGEST)
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise ValueError(f"{error}; logs need the extra: pip install 'birthsim[log]'") from error
    try:
        table = pq.read_table(pa.BufferReader(content))
        kinds = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean)
        columns = {
            field.name: table.column(field.name).to_numpy().astype(np.float64)
            for field in table.schema
            if any(kind(field.type) for kind in kinds)
        }
    except (pa.ArrowException, OSError) as error:
        raise ValueError(f"{source} is no Parquet ({problem(error)})") from error
    return Table(source, columns)


def _read_mcap(path: Path) -> Table:
    """The channel of JSON messages that has the most of them; a message's ``log_time`` is its time unless it holds one."""
    source = f"log = {str(path)!r}"
    content = read("log", path, LARGEST)
    try:
        from mcap.reader import make_reader
    except ImportError as error:
        raise ValueError(f"{error}; logs need the extra: pip install 'birthsim[log]'") from error
    rows: dict[str, list[dict[str, Any]]] = {}
    try:
        for _, channel, message in make_reader(io.BytesIO(content)).iter_messages():
            if channel.message_encoding != "json":
                raise ValueError(f"channel {channel.topic} has messages in {channel.message_encoding}; allowed: json")
            said = json.loads(message.data)
            rows.setdefault(channel.topic, []).append({"log_time": 1e-9 * message.log_time, **said})
    except Exception as error:
        # Damage trips mcap, struct, its compressors and json in a dozen ways.
        raise ValueError(f"{source} cannot be read as MCAP ({problem(error)})") from error
    longest = max(rows.values(), key=len, default=[])
    names = [name for name, value in longest[0].items() if isinstance(value, (int, float))] if longest else []
    columns = {name: np.array([_number(row.get(name)) for row in longest]) for name in names}
    return Table(source, columns)


def _number(value: object) -> float:
    """A value of JSON as a number; NaN where it is none."""
    try:
        return float(value) if isinstance(value, (int, float)) else np.nan
    except OverflowError:
        return np.nan


READERS: dict[str, Callable[[Path], Table]] = {".csv": read_csv, ".parquet": _read_parquet, ".mcap": _read_mcap}
"""Suffix -> what reads a file of it."""
