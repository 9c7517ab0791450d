"""Logs as Parquet and as MCAP, whole or not at all.

Parquet: a table of all series, columns ``topic`` and ``log_time``, s, before theirs. Each field's metadata has ``unit``
and ``description``; the schema's has ``birthsim``: version, rig and events as JSON. Every number is the same to the last bit.

MCAP: a channel of JSON messages per topic, whose schema describes every field with its unit; a channel per kind of events, with
the event as JSON text; a metadata record ``birthsim``. Numbers are the shortest decimals that read as the same
number. JSON has none that is not finite: a message leaves it out. Null, or a field of two types, is more than Foxglove reads.
"""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np

import birthsim_env
from baselines.logs.log import Log, Series
from birthsim_env.extras import installation
from birthsim_env.files import finite, whole_file

_TYPES = {"f": "number", "i": "integer", "b": "boolean"}
"""Kind of a NumPy type -> its type in a JSON schema."""


def write_log(log: Log, path: Path) -> None:
    """Write a log to a file ``.parquet`` or ``.mcap``; needs the extra ``log``."""
    with whole_file(path) as file:
        WRITERS[path.suffix.lower()](log, file)


def _about(log: Log) -> dict[str, str]:
    content = {"version": birthsim_env.__version__, **log.about}
    return {name: value if isinstance(value, str) else json.dumps(finite(value)) for name, value in content.items()}


def _write_parquet(log: Log, file: BinaryIO) -> None:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise ValueError(f"{error}; logs need the extra: {installation('log')}") from error
    columns = {
        "topic": (
            pa.array(np.repeat([one.topic for one in log.series], [len(one.times) for one in log.series])),
            "1",
            "series",
        ),
        "log_time": (pa.array(np.concatenate([one.times for one in log.series])), "s", "time in the log"),
    }
    for name, (unit, meaning) in log.columns.items():
        columns[name] = pa.array(np.concatenate([one.values[name] for one in log.series])), unit, meaning
    fields = [
        pa.field(name, array.type, metadata={"unit": unit, "description": meaning})
        for name, (array, unit, meaning) in columns.items()
    ]
    about = {**_about(log), "events": json.dumps(finite([event._asdict() for event in log.events]))}
    schema = pa.schema(fields, metadata={"birthsim": json.dumps(about)})
    pq.write_table(pa.Table.from_arrays([array for array, _, _ in columns.values()], schema=schema), file)


def _write_mcap(log: Log, file: BinaryIO) -> None:
    try:
        from mcap.writer import Writer
    except ImportError as error:
        raise ValueError(f"{error}; logs need the extra: {installation('log')}") from error
    writer = Writer(file)
    writer.start(library=f"birthsim {birthsim_env.__version__}")
    writer.add_metadata("birthsim", _about(log))
    for one in log.series:
        schema = writer.register_schema(f"birthsim{one.topic}", "jsonschema", json.dumps(_schema(log, one)).encode())
        channel = writer.register_channel(one.topic, "json", schema)
        names, rows = list(one.values), zip(*(column.tolist() for column in one.values.values()), strict=True)
        for time, row in zip(one.times, rows, strict=True):
            now = round(float(time) * 1e9)
            content = {name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)}
            writer.add_message(channel, now, json.dumps(content).encode(), now)
    channels: dict[str, int] = {}
    for event in log.events:
        if event.kind not in channels:
            described = {
                "type": "object",
                "properties": {event.kind: {"type": "string", "description": "JSON; holds from here on"}},
            }
            number = writer.register_schema(f"birthsim/{event.kind}", "jsonschema", json.dumps(described).encode())
            channels[event.kind] = writer.register_channel(f"/{event.kind}", "json", number)
        now = round(event.time * 1e9)
        content = {event.kind: json.dumps(finite(event.value))}
        writer.add_message(channels[event.kind], now, json.dumps(content).encode(), now)
    writer.finish()  # type: ignore[no-untyped-call]


def _schema(log: Log, series: Series) -> dict[str, object]:
    properties = {
        name: {
            "type": _TYPES[series.values[name].dtype.kind],
            "description": meaning if unit == "1" else f"{meaning}, {unit}",
            "unit": unit,
        }
        for name, (unit, meaning) in log.columns.items()
    }
    return {"type": "object", "properties": properties}


WRITERS: dict[str, Callable[[Log, BinaryIO], None]] = {".parquet": _write_parquet, ".mcap": _write_mcap}
"""Suffix -> what writes a file of it."""
