"""Kinds of tables: logs as CSV, Parquet, MCAP and MATLAB files, in odd dialects, with odd cells, altered and damaged."""

import contextlib
import io
import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.fuzz.files import written
from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng, altered, damaged, json_bytes, plain

ROWS = 30

MAPPED = (*[""] * 12, "force_x=a,force_y=none", "force_x=none,force_y=none", "force_x", "=", "force_x=Fx,force_y=Fx")

HEADINGS = (
    *("Fx", "force_x [N]", "Force_y", "F [kN]", "time (s)", "t_ms", "log_time", "topic", "", "a", "a", "x", "pressures[P1]"),
    *("openings_P1 %", "comment", "position_x / mm", "(s)", "[", "pressures_P1 (bar)", "\U0001f600"),
)
CELLS = (
    *("", "-", "NaN", "#N/A", "1,5", "1.234,5", "1 234", "1_0", "1e999", "1D3", "0x10", "1+2j", "5 N", "go", '"', "'"),
    *("2024-02-30", "2024-02-28T10:00:00.5Z", "9999-12-31 23:59:59", "10:00:01", "99:59:59.9", "\x00", "9" * 400, "\u0663"),
)
BLOCKS = (
    *("", "# remark\n", "sep=;\n", "Laboratory\nOperator;Max\n\n", "Channels\t2\n***End_of_Header***\n", "s,m,N\n"),
    *("\ufeff", '"\n'),
)


def columns(rng: Rng) -> dict[str, list[Any]]:
    """Columns of a log, of which some are odd or gone or in another order."""
    from baselines.identification.log_columns import COLUMNS

    values = {name: rng.uniform(-1, 1, ROWS).tolist() for name in COLUMNS}
    values["time"] = [1e-3 * row for row in range(ROWS)]
    for _ in range(int(rng.integers(4))):
        name = list(values)[rng.integers(len(values))]
        column = values.pop(name)
        match int(rng.integers(4)):
            case 0:
                values[str(HEADINGS[rng.integers(len(HEADINGS))])] = column
            case 1:
                column[rng.integers(ROWS)] = CELLS[rng.integers(len(CELLS))]
                values[name] = column
            case 2:
                values[name] = [CELLS[rng.integers(len(CELLS))]] * ROWS
            case _:
                pass
    return values


def _text(rng: Rng, values: dict[str, list[Any]]) -> bytes:
    separator = (",", ",", ";", "\t", " ", "|")[rng.integers(6)]
    lines = [separator.join(values), *(separator.join(map(str, row)) for row in zip(*values.values(), strict=True))]
    if rng.random() < 0.2:
        line = int(rng.integers(len(lines)))
        lines[line] = lines[line][: int(rng.integers(len(lines[line]) + 1))] + str(plain(rng))[:500]
    end = ("\n", "\n", "\r\n", "\r", separator + "\n")[rng.integers(5)]
    text = BLOCKS[rng.integers(len(BLOCKS))] + end.join(lines)
    encoding = ("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252", "utf-32")[rng.integers(7)]
    return text.encode(encoding, "replace")


def _parquet(rng: Rng, values: dict[str, list[Any]]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = (pa.float64(), pa.string(), pa.float32(), pa.timestamp("ms"), pa.decimal128(38, 6), pa.int64())
    arrays = {}
    for name, column in values.items():
        arrays[name] = pa.array([str(value) for value in column])
        kind = kinds[rng.integers(len(kinds)) if rng.random() < 0.2 else 0]
        with contextlib.suppress(pa.ArrowException):
            arrays[name] = pa.array(
                [float(value) for value in column] if not any(isinstance(v, str) for v in column) else column
            )
            arrays[name] = arrays[name].cast(kind, safe=False)
    if rng.random() < 0.3:
        arrays["force"] = pa.array([{"x": 1.0, "y": None}, None] * (ROWS // 2))
        arrays["many"] = pa.array([[1.0]] * ROWS)
    content = io.BytesIO()
    pq.write_table(pa.table(arrays), content, compression=("none", "snappy", "zstd", "gzip")[rng.integers(4)])
    return content.getvalue()


def _mcap(rng: Rng, values: dict[str, list[Any]]) -> bytes:
    from mcap.writer import CompressionType, Writer

    content = io.BytesIO()
    writer = Writer(content, compression=(CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD)[rng.integers(3)])
    writer.start()
    schema = writer.register_schema("log", "jsonschema", b"{}")
    encodings = ("json", "json" if rng.random() < 0.8 else "ros1")
    channels = [writer.register_channel(f"/{k}", encoding, schema) for k, encoding in enumerate(encodings)]
    for row, one in enumerate(zip(*values.values(), strict=True)):
        message: Any = dict(zip(values, one, strict=True))
        if rng.random() < 0.1:
            message = altered(rng, message)
        data = json_bytes(rng, message) if rng.random() < 0.01 else json.dumps(message, default=str).encode()
        writer.add_message(channels[rng.random() < 0.1], row, data, row)
    writer.finish()  # type: ignore[no-untyped-call]
    return content.getvalue()


def _matlab(rng: Rng, values: dict[str, list[Any]]) -> bytes:
    from scipy.io import savemat

    variables: dict[str, Any] = {}
    for place, (name, column) in enumerate(values.items()):
        known = name.isidentifier() and name.isascii() and len(name) < 31 and not name.startswith("_")
        array = np.array(column, dtype=object if any(isinstance(value, str) for value in column) else float)
        variables[name if known else f"odd{place}"] = array[: int(rng.integers(ROWS))] if rng.random() < 0.05 else array
    match int(rng.integers(5)):
        case 0:
            variables = {"log": variables}
        case 1:
            variables["signals"] = np.array([(np.ones(ROWS), "Fx")], dtype=[("values", object), ("label", object)])
        case 2:
            variables |= {"data": np.ones((ROWS, 2)), "names": np.array(["a", "b"], dtype=object), "z": np.ones(ROWS) + 1j}
    content = io.BytesIO()
    with contextlib.suppress(ValueError, TypeError):
        savemat(content, variables, do_compression=bool(rng.integers(2)))
    return content.getvalue()


FORMS: dict[str, Callable[[Rng, dict[str, list[Any]]], bytes]] = {
    **dict.fromkeys((".csv", ".CSV", ".txt"), _text),
    **{".parquet": _parquet, ".mcap": _mcap, ".mat": _matlab},
}


def _loaded(folder: Path) -> None:
    """What the readers need, before memory is limited."""
    from baselines.logs.table import read_table

    rng = np.random.default_rng(0)
    for form, write in FORMS.items():
        path = folder / f"valid{form}"
        path.write_bytes(write(rng, {"time": [0.0, 1.0] * (ROWS // 2), "a": [1.0] * ROWS}))
        with contextlib.suppress(ValueError):
            assert read_table(path).columns


def _log(_: None, rng: Rng, folder: Path, case: Case) -> None:
    from baselines.identification.log_columns import COLUMNS, LogOptions, read_columns

    form = list(FORMS)[rng.integers(len(FORMS))]
    content = FORMS[form](rng, columns(rng))
    path = written(case, folder / f"ours{form}", damaged(rng, content) if rng.random() < 0.4 else content)
    mapped = MAPPED[rng.integers(len(MAPPED))]
    skip = None if rng.random() < 0.85 else int(rng.choice([0, 3, 10**9]))
    options = LogOptions(mapped, skip, bool(rng.random() < 0.08))
    case.names = (path.name, "--columns")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = read_columns(path, options)[1]
    assert list(found) == list(COLUMNS)
    assert len({len(values) for values in found.values()}) == 1


TABLES: dict[str, Kind] = {"log": Kind(_loaded, _log)}
