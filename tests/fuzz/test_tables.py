"""Tables: logs as text, Parquet, MCAP and MATLAB files in odd dialects, and references and hands as CSV."""

import contextlib
import io
import json
import warnings

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from scipy.io import savemat

from baselines.identification.log.log_columns import COLUMNS, LogOptions, read_columns
from birthsim_env import Parameters
from birthsim_env.parts.courses import check_points
from birthsim_env.parts.own_parts import hand_of, trajectory_of
from birthsim_env.parts.times import called, check_times
from tests.fuzz.strategies import altered, composite, damaged, json_texts, plain, sampled
from tests.fuzz.watched import cases, watched

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
ENCODINGS = ("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252", "utf-32")
GOOD = {name: np.random.default_rng(k).uniform(-1, 1, ROWS).tolist() for k, name in enumerate(COLUMNS)}
GOOD["time"] = [1e-3 * row for row in range(ROWS)]


@composite
def columns(draw):
    """Columns of a log, of which up to three are odd, gone or in another place."""
    values = {name: list(column) for name, column in GOOD.items()}
    for _ in range(draw(st.integers(0, 3))):
        name = draw(sampled(list(values)))
        column = values.pop(name)
        match draw(sampled(("heading", "cell", "column", "gone"))):
            case "heading":
                values[draw(sampled(HEADINGS))] = column
            case "cell":
                column[draw(st.integers(0, ROWS - 1))] = draw(sampled(CELLS))
                values[name] = column
            case "column":
                values[name] = [draw(sampled(CELLS))] * ROWS
    return values


@composite
def texts(draw, values):
    separator = draw(sampled((",", ",", ";", "\t", " ", "|")))
    lines = [separator.join(values), *(separator.join(map(str, row)) for row in zip(*values.values(), strict=True))]
    if draw(st.integers(0, 4)) == 0:
        line = draw(st.integers(0, len(lines) - 1))
        lines[line] = lines[line][: draw(st.integers(0, len(lines[line])))] + str(draw(plain))[:500]
    end = draw(sampled(("\n", "\n", "\r\n", "\r", separator + "\n")))
    text = draw(sampled(BLOCKS)) + end.join(lines)
    return text.encode(draw(sampled(ENCODINGS)), "replace")


KINDS = (pa.float64(), pa.string(), pa.float32(), pa.timestamp("ms"), pa.decimal128(38, 6), pa.int64())


@composite
def parquets(draw, values):
    arrays = {}
    for name, column in values.items():
        arrays[name] = pa.array(list(map(str, column)))
        with contextlib.suppress(pa.ArrowException):
            kind = draw(sampled((*[KINDS[0]] * 20, *KINDS)))
            arrays[name] = pa.array(column if any(isinstance(one, str) for one in column) else list(map(float, column)))
            arrays[name] = arrays[name].cast(kind, safe=False)
    if draw(st.booleans()):
        arrays["force"] = pa.array([{"x": 1.0, "y": None}, None] * (ROWS // 2))
        arrays["many"] = pa.array([[1.0]] * ROWS)
    content = io.BytesIO()
    pq.write_table(pa.table(arrays), content, compression=draw(sampled(("none", "snappy", "zstd", "gzip"))))
    return content.getvalue()


@composite
def mcaps(draw, values):
    content = io.BytesIO()
    writer = Writer(content, compression=draw(sampled(list(CompressionType))))
    writer.start()
    schema = writer.register_schema("log", "jsonschema", b"{}")
    encodings = ("json", draw(sampled(("json", "json", "json", "ros1"))))
    channels = [writer.register_channel(f"/{k}", encoding, schema) for k, encoding in enumerate(encodings)]
    odd, other = draw(st.integers(0, 3 * ROWS)), draw(st.integers(0, 3 * ROWS))
    for row, one in enumerate(zip(*values.values(), strict=True)):
        message = dict(zip(values, one, strict=True))
        if row == odd:
            data = draw(json_texts(message) | altered(message).map(lambda tree: json.dumps(tree).encode()))
        else:
            data = json.dumps(message).encode()
        writer.add_message(channels[row == other], row, data, row)
    writer.finish()
    return content.getvalue()


@composite
def matlabs(draw, values):
    variables = {}
    for place, (name, column) in enumerate(values.items()):
        known = name.isidentifier() and name.isascii() and len(name) < 31 and not name.startswith("_")
        array = np.array(column, dtype=object if any(isinstance(one, str) for one in column) else float)
        variables[name if known else f"odd{place}"] = array
    match draw(sampled(("", "", "short", "structure", "array", "more"))):
        case "short":
            name = draw(sampled(list(variables)))
            variables[name] = variables[name][: draw(st.integers(0, ROWS - 1))]
        case "structure":
            variables = {"log": variables}
        case "array":
            variables["signals"] = np.array([(np.ones(ROWS), "Fx")], dtype=[("values", object), ("label", object)])
        case "more":
            variables |= {"data": np.ones((ROWS, 2)), "names": np.array(["a", "b"], dtype=object), "z": np.ones(ROWS) + 1j}
    content = io.BytesIO()
    with contextlib.suppress(ValueError, TypeError):
        savemat(content, variables, do_compression=draw(st.booleans()))
    return content.getvalue()


FORMS = {**dict.fromkeys((".csv", ".CSV", ".txt"), texts), ".parquet": parquets, ".mcap": mcaps, ".mat": matlabs}


@pytest.mark.parametrize("form", FORMS)
@cases
@given(data=st.data())
def test_a_log(form, data):
    content = data.draw(columns().flatmap(FORMS[form]))
    content = data.draw(sampled([content]) | sampled([content]) | damaged(content))
    options = LogOptions(
        data.draw(sampled(MAPPED)),
        data.draw(sampled((*[None] * 9, 0, 3, 10**9))),
        data.draw(st.integers(0, 9)) == 9,
    )
    with warnings.catch_warnings(), watched(f"ours{form}", "--columns", memory=2**30) as case:
        warnings.simplefilter("ignore", UserWarning)
        path = case.folder / f"ours{form}"
        path.write_bytes(content)
        found = read_columns(path, options)[1]
        assert list(found) == list(COLUMNS)
        assert len({len(values) for values in found.values()}) == 1


@composite
def courses(draw):
    """A CSV file of points or forces over time, of which some cells are odd."""
    times = 0.1 * np.arange(draw(st.integers(1, 39)))
    lines = ["time, x, y", *(f"{t},{0.5 + 0.01 * t:.4f},0.01" for t in times)]
    for _ in range(draw(st.integers(0, 3))):
        line = draw(st.integers(0, len(lines) - 1))
        cells = lines[line].split(",")
        cells[draw(st.integers(0, len(cells) - 1))] = str(draw(plain | sampled(["9" * 5000])))
        lines[line] = ",".join(cells[: draw(st.integers(1, 4))])
    text = "\n".join(lines).encode()
    return draw(sampled([text]) | damaged(text))


@pytest.mark.parametrize("part", ["reference", "user_force"])
@cases
@given(content=courses())
def test_a_course(part, content):
    with watched("ours.csv") as case:
        path = case.folder / "ours.csv"
        path.write_bytes(content)
        if part == "reference":
            course = trajectory_of(path, 1.0)
            assert np.isfinite(course.sample(np.linspace(-1.0, 5.0, 99))).all()
            check_times(part, path, course.timed, 1.0, True)
            check_points(called(part, path), course, 1.0, Parameters())
        else:
            course = hand_of(path, False)
            check_times(part, path, course.timed, 1.0, True)
            course.prepare(2)
            course.begin(0, np.random.default_rng(0))
            assert np.isfinite(course.force(np.zeros((1, 2)), np.zeros((2, 2)), np.zeros((2, 2)))).all()
