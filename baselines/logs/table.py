"""Tables of named columns from CSV, Parquet and MCAP files, whoever wrote them."""

import csv
import io
from array import array
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.reading import read
from birthsim_env.physics.rig.values import in_line, problem, shown

LARGEST = 512 * 2**20
"""Bytes of a log, of its numbers in memory, and of what a packed one holds; an hour at 1 kHz takes some 400 MB as CSV."""

LONGEST = 2**20
"""Bytes of a line or a message."""

BATCH = 2**16
"""Rows that are unpacked at a time."""


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
    names: list[str] = []
    numbers = array("d")
    try:
        for number, text in enumerate(_lines(read("log", path, LARGEST)), start=1):
            # Line by line: no number has a quoted end of a line in it, and an open quote would gather all that follow.
            line = next(csv.reader([text]), [])
            if not line or line[0].lstrip().startswith("#"):
                continue
            if names:
                numbers.extend(_row(source, number, line, names))
                _check_size(source, len(numbers))
                continue
            names = [name.strip() for name in line]
            _check_names(source, names)
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{source} is no CSV ({problem(error)})") from error
    if not names:
        raise ValueError(f"{source} is empty; allowed: a line of names, then lines of numbers")
    return Table(source, dict(zip(names, np.frombuffer(numbers).reshape(-1, len(names)).T, strict=True)))


def _lines(content: bytes) -> Iterator[str]:
    text = io.TextIOWrapper(io.BytesIO(content), "utf-8-sig", newline="")
    while line := text.readline(LONGEST + 1):
        if len(line) > LONGEST:
            raise csv.Error(f"a line is longer than allowed: at most {LONGEST} characters")
        yield line


def _row(source: str, number: int, line: list[str], names: list[str]) -> list[float]:
    try:
        row = [float(value) if value.strip() else np.nan for value in line]
    except ValueError:
        row = []
    if len(row) != len(names):
        words = f"allowed: {len(names)} numbers, for {', '.join(names)}"
        raise ValueError(f"{source}, line {number}: {shown(','.join(line))}; {in_line(words)}")
    return row


def _check_names(source: str, names: list[str]) -> None:
    if len(names) == 1 and ";" in names[0]:
        raise ValueError(f"{source} has one column, {shown(names[0])}; allowed: columns separated by commas")
    if len(set(names)) < len(names):
        twice = next(name for name, count in Counter(names).items() if count > 1)
        raise ValueError(f"{source} has two columns {twice!r}; allowed: one of each name")


def _check_size(source: str, numbers: int) -> None:
    if 8 * numbers > LARGEST:
        raise ValueError(f"{source} has at least {numbers} numbers; allowed: {LARGEST // 8}, which take {LARGEST} bytes")


def _read_parquet(path: Path) -> Table:
    source = f"log = {str(path)!r}"
    content = read("log", path, LARGEST)
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise ValueError(f"{error}; logs need the extra: pip install 'birthsim[log]'") from error
    kinds = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean)
    try:
        file = pq.ParquetFile(pa.BufferReader(content))
        names = [field.name for field in file.schema_arrow if any(kind(field.type) for kind in kinds)]
        _check_names(source, names)
        _check_size(source, file.metadata.num_rows * len(names))
        columns = {name: np.empty(file.metadata.num_rows) for name in names}
        for name, column in columns.items():
            place = 0
            for batch in file.iter_batches(BATCH, columns=[name]):
                part = batch.column(name).to_numpy(zero_copy_only=False)[: len(column) - place]
                column[place : place + len(part)] = part.astype(np.float64)
                place += len(batch)
                if place > len(column):
                    break
            if place != len(column):
                raise pa.ArrowInvalid(f"column {name} has {place} rows, the file says {len(column)}")
    except (pa.ArrowException, OSError) as error:
        raise ValueError(f"{source} is no Parquet ({problem(error)})") from error
    return Table(source, columns)


def _read_mcap(path: Path) -> Table:
    """The channel of JSON messages that has the most of them; a message's ``log_time`` is its time unless it holds one."""
    source = f"log = {str(path)!r}"
    content = read("log", path, LARGEST)
    try:
        from baselines.logs.messages import json_messages
    except ImportError as error:
        raise ValueError(f"{error}; logs need the extra: pip install 'birthsim[log]'") from error
    topics: dict[str, tuple[list[str], array[float], array[int]]] = {}
    size = 0
    try:
        for topic, time, message in json_messages(content, LARGEST, LONGEST):
            said = {"log_time": 1e-9 * time, **message}
            if topic not in topics:
                names = [name for name, value in said.items() if isinstance(value, (int, float))]
                topics[topic] = names, array("d"), array("Q")
            names, numbers, order = topics[topic]
            numbers.extend(_number(said.get(name)) for name in names)
            order.append(time)
            size += len(names) + 1
            _check_size(source, size)
    except Exception as error:
        # Damage trips mcap, struct, its compressors and json in a dozen ways.
        raise ValueError(f"{source} cannot be read as MCAP ({problem(error)})") from error
    names, numbers, order = max(topics.values(), key=lambda topic: len(topic[2]), default=([], array("d"), array("Q")))
    rows = np.frombuffer(numbers).reshape(len(order), len(names))
    return Table(source, dict(zip(names, rows[np.argsort(order, kind="stable")].T, strict=True)))


def _number(value: object) -> float:
    """A value of JSON as a number; NaN where it is none."""
    try:
        return float(value) if isinstance(value, (int, float)) else np.nan
    except OverflowError:
        return np.nan


READERS: dict[str, Callable[[Path], Table]] = {".csv": read_csv, ".parquet": _read_parquet, ".mcap": _read_mcap}
"""Suffix -> what reads a file of it."""
