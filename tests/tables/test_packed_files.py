"""Tables in Parquet, MCAP and MATLAB files: what pandas, ROS, Simulink and dSPACE write, and what cannot be read of it."""

import datetime
import decimal
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csr_array

from baselines.logs.table import read_table
from birthsim_env.tables.selection import Selection
from birthsim_env.tables.table import Reading, Table

TIMES, VALUES = np.array([0.0, 0.25, 0.5, 0.75]), np.array([7.0, -3.0, 0.5, 1e-3])
FIELDS = {"time": "s", "force_x": "N"}
START = 1_700_000_000_000_000_000
"""ns since 1970."""


def chosen(table: Table) -> tuple[np.ndarray, np.ndarray]:
    """Time and force in SI."""
    selection = Selection(table, FIELDS, {}, "others")
    selection.check(FIELDS)
    return selection.values("time"), selection.values("force_x")


def same(table: Table) -> None:
    times, force = chosen(table)
    np.testing.assert_allclose(times, TIMES, atol=1e-12)
    np.testing.assert_allclose(force, VALUES, rtol=1e-12)


def parquet(kind: str) -> Any:
    """Columns of a Parquet file."""
    import pyarrow as pa

    ticks = [int(250_000_000 * k) for k in range(4)]
    stamps = [START + tick for tick in ticks]
    texts = [str(value) for value in VALUES]
    force = pa.array(VALUES)
    columns = {
        "numbers": (TIMES, VALUES),
        "decimals": (TIMES, pa.array([decimal.Decimal(str(value)) for value in VALUES], pa.decimal128(9, 4))),
        "texts": (texts and [str(time) for time in TIMES], texts),
        "categories": (TIMES, pa.array(texts).dictionary_encode()),
        "large texts": (TIMES, pa.array(texts, pa.large_string())),
        "categories of numbers": (TIMES, force.dictionary_encode()),
        "timestamps": (pa.array(stamps, pa.timestamp("ns")), VALUES),
        "timestamps in a zone": (pa.array(stamps, pa.timestamp("ns", tz="Europe/Zurich")), VALUES),
        "timestamps of Python": ([datetime.datetime(2024, 3, 1, 9, 0, 0, 250_000 * k) for k in range(4)], VALUES),
        "durations": (pa.array(ticks, pa.duration("ns")), VALUES),
        "times of a day": (pa.array([t // 1000 for t in ticks], pa.time64("us")), VALUES),
        "texts of dates": ([f"2024-03-01 23:59:59.{int(100 * time):02d}" for time in TIMES], VALUES),
        "floats of 32 bits": (TIMES.astype(np.float32), VALUES),
    }[kind]
    return pa.table({"time": columns[0], "force_x": columns[1]})


PARQUET = (
    *(
        "numbers",
        "decimals",
        "texts",
        "categories",
        "large texts",
        "categories of numbers",
        "timestamps",
        "timestamps in a zone",
    ),
    *("timestamps of Python", "durations", "times of a day", "texts of dates", "floats of 32 bits"),
)


@pytest.mark.parametrize("kind", PARQUET)
def test_columns_of_parquet(kind: str, tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    pq.write_table(parquet(kind), tmp_path / "own.Parquet")
    same(read_table(tmp_path / "own.Parquet"))


@pytest.mark.parametrize("word", ["unit", "units", "Unit"])
def test_units_of_fields_of_parquet(word: str, tmp_path: Path) -> None:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    milli = pa.field("time", pa.float64(), metadata={word: "ms"})
    pq.write_table(pa.table([1e3 * TIMES, VALUES], pa.schema([milli, ("force_x", pa.float64())])), tmp_path / "own.parquet")
    same(read_table(tmp_path / "own.parquet"))


def test_fields_of_a_structure_units_of_metadata_and_what_parquet_cannot_say(tmp_path: Path) -> None:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    inside = pa.array([{"x": value, "y": 1.0} for value in VALUES])
    milli = pa.field("time", pa.float64(), metadata={"unit": "ms"})
    lists = pa.array([[1.0]] * 4)
    holes = pa.array([1.0, None, 2.0, 3.0])
    table = pa.table({"time": 1e3 * TIMES, "force": inside, "many": lists, "holes": holes, "none": pa.nulls(4)})
    pq.write_table(table.cast(table.schema.set(0, milli)), tmp_path / "own.parquet")
    found = read_table(tmp_path / "own.parquet")
    same(found)
    np.testing.assert_array_equal(found.column("holes"), [1.0, np.nan, 2.0, 3.0])
    assert np.isnan(found.column("none")).all()
    with pytest.raises(ValueError, match=r"'many': holds 'list.*allowed: numbers, texts that are numbers, and timestamps"):
        found.column("many")
    pq.write_table(pa.table({"time": ["0", "a bit later"]}), tmp_path / "own.parquet")
    with pytest.raises(ValueError, match="column 'time': row 1: 'a bit later' is no number"):
        read_table(tmp_path / "own.parquet").column("time")


def mcap(path: Path, messages: list[tuple[str, Any]], encodings: dict[str, str] | None = None) -> Path:
    writer = pytest.importorskip("mcap.writer", reason="mcap is not installed: pip install -e '.[log]'").Writer
    with path.open("wb") as file:
        log = writer(file)
        log.start()
        schema = log.register_schema("own", "jsonschema", b"{}")
        channels = {topic: log.register_channel(topic, (encodings or {}).get(topic, "json"), schema) for topic, _ in messages}
        for row, (topic, message) in enumerate(messages):
            content = message if isinstance(message, bytes) else json.dumps(message).encode()
            log.add_message(channels[topic], 250_000_000 * row, content, 250_000_000 * row)
        log.finish()
    return path


ROWS = [{"time": float(time), "force_x": float(value)} for time, value in zip(TIMES, VALUES, strict=True)]
MCAP: dict[str, list[dict[str, Any]]] = {
    "numbers": ROWS,
    "texts": [{name: str(value) for name, value in row.items()} for row in ROWS],
    "dates": [row | {"time": f"2024-03-01T00:00:00.{int(100 * row['time']):02d}Z"} for row in ROWS],
    "times of ROS": [row | {"time": {"sec": 0, "nsec": int(1e9 * row["time"])}} for row in ROWS],
    "objects": [{"time": row["time"], "force": {"x": row["force_x"], "y": None}} for row in ROWS],
    "no time but the log's": [{"force_x": row["force_x"], "other": 1} for row in ROWS],
}


@pytest.mark.parametrize("kind", MCAP)
def test_columns_of_mcap(kind: str, tmp_path: Path) -> None:
    same(read_table(mcap(tmp_path / "own.MCAP", [("/rig", row) for row in MCAP[kind]])))


def test_no_message_says_alone_which_columns_there_are(tmp_path: Path) -> None:
    rows = [{"time": 0.0, "force_x": None}, {"time": 0.25, "late": 1}, *ROWS[2:]]
    times, force = chosen(read_table(mcap(tmp_path / "own.mcap", [("/rig", row) for row in rows])))
    np.testing.assert_allclose(times, TIMES)
    np.testing.assert_array_equal(force, [np.nan, np.nan, *VALUES[2:]])


def test_the_channel_with_known_columns_is_read_and_others_are_named(tmp_path: Path) -> None:
    messages = [("/imu", {"a": 1})] * 4 + [("/tf", b"\x01")] + [("/rig", row) for row in ROWS]
    table = read_table(mcap(tmp_path / "own.mcap", messages, {"/tf": "protobuf"}))
    same(table)
    assert [note.partition("own.mcap'")[2] for note in table.notes] == [": /rig is read; not read: /imu, /tf"]


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([], "has no messages; allowed: messages in JSON"),
        ([("/tf", b"\x01")], "has no JSON messages, but /tf; allowed: messages in JSON"),
        ([("/rig", [1])], r"a message of /rig .*content = \[1\]; allowed: an object"),
        ([("/rig", {"time": 1, "force_x": [1]})], r"column 'force_x': row 0: \[1\] is no number; allowed: numbers"),
        ([("/rig", {"time": 1, "force_x": "much"})], "column 'force_x': row 0: 'much' is no number; allowed: numbers"),
        ([("/rig", {"time": 10**400, "force_x": 1})], "a message of /rig .*401 digits, more than 300; allowed: JSON"),
    ],
)
def test_what_mcap_cannot_say(messages: list[tuple[str, Any]], words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=words):
        chosen(read_table(mcap(tmp_path / "own.mcap", messages, {"/tf": "protobuf"})))


def test_many_names_in_many_messages_take_no_memory_that_is_not_allowed(tmp_path: Path) -> None:
    messages = [("/rig", {f"name {row}": 1}) for row in range(300)]
    with pytest.raises(ValueError, match="numbers; allowed: "):
        read_table(mcap(tmp_path / "own.mcap", messages), Reading(most=200_000))


NAMED = np.dtype([("Data", object), ("Name", object), ("Unit", object)])
LABELLED = np.dtype([("values", object), ("label", object)])
MATRIX = np.column_stack([TIMES, VALUES])
MATLAB: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "vectors": ({"time": TIMES, "force_x": VALUES}, {}),
    "columns": ({"time": TIMES, "force_x": VALUES}, {"oned_as": "column"}),
    "compressed": ({"time": TIMES, "force_x": VALUES}, {"do_compression": True}),
    "version 4": ({"time": TIMES, "force_x": VALUES}, {"format": "4"}),
    "a scalar and a text beside": ({"time": TIMES, "force_x": VALUES, "rate": 4.0, "who": "Max"}, {}),
    "a structure": ({"log": {"t": TIMES, "Fx": VALUES}}, {"do_compression": True}),
    "structures": ({"log": {"t": TIMES, "force": {"x": VALUES, "y": VALUES}}}, {}),
    "Simulink": ({"out": {"time": TIMES, "signals": np.array([(VALUES, "force_x")], dtype=LABELLED)}}, {}),
    "dSPACE": (
        {
            "run": {
                "X": np.array([(1e3 * TIMES, "time", "ms")], dtype=NAMED),
                "Y": np.array([(VALUES, "Fx", "N"), (VALUES, "other", "V")], dtype=NAMED),
            }
        },
        {},
    ),
    "a matrix with names": ({"data": MATRIX, "names": np.array(["time", "Fx"], dtype=object)}, {}),
    "a matrix on its side": ({"data": MATRIX.T, "names": np.array(["time", "Fx"], dtype=object)}, {}),
    "texts": ({"time": TIMES, "force_x": np.array([str(value) for value in VALUES], dtype=object)}, {}),
    "no imaginary part": ({"time": TIMES, "force_x": VALUES + 0j}, {}),
}


@pytest.mark.parametrize("kind", MATLAB)
def test_columns_of_matlab(kind: str, tmp_path: Path) -> None:
    content, options = MATLAB[kind]
    savemat(tmp_path / "own.mat", content, **options)
    (tmp_path / "own.mat").rename(tmp_path / "own.MAT")
    same(read_table(tmp_path / "own.MAT"))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"time": TIMES, "force_x": VALUES[:3], "a": VALUES}, "'force_x': has 3 values, others 4; allowed: as many"),
        ({"time": TIMES, "force_x": VALUES + 1j}, "'force_x': is complex; allowed: real numbers"),
        ({"time": TIMES, "force_x": csr_array(VALUES[None])}, "'force_x': is .*; allowed: full arrays of numbers"),
        ({"time": TIMES, "force_x": MATRIX}, "'force_x': is a matrix of 4 x 2; allowed: vectors, or one cell array"),
        ({"time": TIMES, "force_x": "much"}, "'force_x': holds no numbers; allowed: vectors of numbers"),
        ({"a": 1.0}, "has no vectors, but: a; allowed: vectors"),
        ({}, "has no vectors, but: nothing; allowed: vectors"),
        ({"time": TIMES, "Fx": VALUES, "f_x": VALUES}, "Fx and f_x, which may each be force_x; allowed: one of them"),
    ],
)
def test_what_matlab_cannot_say(content: dict[str, Any], words: str, tmp_path: Path) -> None:
    savemat(tmp_path / "own.mat", content)
    with pytest.raises(ValueError, match=words):
        chosen(read_table(tmp_path / "own.mat"))


def test_other_matlab_files_and_others_are_named(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM"
    bomb = zlib.compress(bytes(2**22))
    version5 = b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + (15).to_bytes(4, "little") + len(bomb).to_bytes(4, "little")
    for content, words in (
        (header, "MATLAB 7.3 file .HDF5.*allowed: one of save"),
        (b"rubbish" * 40, "cannot be read as MATLAB .*allowed: one of save"),
        (b"", "cannot be read as MATLAB .*allowed: one of save"),
        (version5 + bomb, "holds more than 1048576 bytes.*allowed"),
    ):
        (tmp_path / "own.mat").write_bytes(content)
        with pytest.raises(ValueError, match=words):
            read_table(tmp_path / "own.mat", Reading(most=2**20))
    with pytest.raises(ValueError, match=r"allowed: a file that ends in .csv, .*; save the sheet as CSV"):
        read_table(tmp_path / "own.xlsx")
