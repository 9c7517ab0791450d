"""Columns of Parquet files: numbers, decimals, texts that are numbers, instants and durations."""

from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import problem, shown
from birthsim_env.tables.cells import Cells
from birthsim_env.tables.table import LONGEST, Raw, Reading

BATCH = 2**16
"""Rows that are unpacked at a time."""


def parquet_columns(source: str, content: bytes, how: Reading) -> list[Raw]:
    """The columns of a Parquet file; a field's metadata may have its ``unit``, and fields of a structure are columns."""
    try:
        about = pq.ParquetFile(pa.BufferReader(content))
        texts = [field.name for field in about.schema_arrow if _is_text(field.type)]
        # A text that is repeated stays packed, whatever it takes unpacked.
        file = pq.ParquetFile(pa.BufferReader(content), read_dictionary=texts)
        count = file.metadata.num_rows
        how.check_size(source, count * len(file.schema_arrow))
        return [one for field in file.schema_arrow for one in _columns(file, field, count, how)]
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{source} is no Parquet ({problem(error)}); allowed: what pandas or Polars writes") from error


def _columns(file: Any, field: Any, count: int, how: Reading) -> list[Raw]:
    """The column of a field, or those of the fields in it."""
    fields = [(field.name, field)]
    if pa.types.is_struct(field.type):
        fields = [(f"{field.name}.{inner.name}", inner) for inner in field.type]
    columns = [(name, _Column(one, count)) for name, one in fields]
    place = 0
    for batch in file.iter_batches(BATCH, columns=[field.name]):
        parts = batch.column(0).flatten() if pa.types.is_struct(field.type) else [batch.column(0)]
        for (_, column), part in zip(columns, parts, strict=True):
            column.take(part[: count - place], place)
        place += len(batch)
        if place > count:
            break
    if place != count:
        raise pa.ArrowInvalid(f"column {field.name} has {place} rows, the file says {count}")
    return [column.raw(name) for name, column in columns]


class _Column:
    """Numbers of a field (T,), part by part."""

    def __init__(self, field: Any, count: int) -> None:
        about = {name.lower(): words for name, words in (field.metadata or {}).items()}
        said = about.get(b"unit", about.get(b"units", b"")).decode(errors="replace")
        self._type, self._values, self._cells = field.type, np.full(count, np.nan), Cells()
        self._unit, self._fault = "" if said == "1" else said, ""
        self._first: int | None = None
        self._is_clock = pa.types.is_timestamp(field.type)
        if pa.types.is_duration(field.type) or pa.types.is_time(field.type):
            self._unit = "s"

    def raw(self, name: str) -> Raw:
        return Raw(name, self._values, self._unit, self._fault or self._cells.fault, self._is_clock or self._cells.is_clock)

    def take(self, part: Any, place: int) -> None:
        kinds = pa.types
        if kinds.is_dictionary(part.type) and not _is_text(part.type.value_type):
            part = part.dictionary_decode()
        kind = part.type
        if kinds.is_integer(kind) or kinds.is_floating(kind) or kinds.is_boolean(kind):
            found = part.to_numpy(zero_copy_only=False).astype(np.float64)
        elif kinds.is_decimal(kind):
            found = part.cast(pa.float64()).to_numpy(zero_copy_only=False)
        elif kinds.is_timestamp(kind) or kinds.is_duration(kind) or kinds.is_time(kind):
            found = self._instants(part)
        elif kinds.is_dictionary(kind) or _is_text(kind):
            found = self._texts(part if kinds.is_dictionary(kind) else part.dictionary_encode(), place)
        elif kinds.is_null(kind):
            return
        else:
            self._fault = f"holds {shown(str(kind))}; allowed: numbers, texts that are numbers, and timestamps"
            return
        self._values[place : place + len(part)] = found

    def _instants(self, part: Any) -> Array:
        """s, since the first one where they have a date."""
        per_second = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[part.type.unit]
        whole = part.cast(pa.int32() if pa.types.is_time32(part.type) else pa.int64()).cast(pa.int64())
        missing = whole.is_null().to_numpy(zero_copy_only=False)
        ticks = whole.fill_null(0).to_numpy(zero_copy_only=False)
        if self._is_clock and self._first is None and not missing.all():
            self._first = int(ticks[np.argmin(missing)])
        return np.where(missing, np.nan, (ticks - (self._first or 0)) / per_second)

    def _texts(self, part: Any, place: int) -> list[float]:
        words = ["" if word is None else word[:LONGEST] for word in part.dictionary.to_pylist()]
        said = ["" if k < 0 else words[k] for k in part.indices.fill_null(-1).to_pylist()]
        return [self._cells.read(text, row, f"row {row}") for row, text in enumerate(said, start=place)]


def _is_text(kind: Any) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind))
