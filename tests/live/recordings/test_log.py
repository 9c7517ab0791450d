"""Logs: every number of a recording or evaluation comes back to the last bit, with its unit, or a line says what is wrong."""

import json
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from baselines.bench import pieces
from baselines.logs import writing
from baselines.work import tasks
from birthsim_env.files import write_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs import reading
from birthsim_live.logs import recording as recordings
from birthsim_live.logs.recording import load_recording
from tests.console import call
from tests.live.recordings.made import example, write_recording

HEAD = ["topic", "log_time"]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A recording with a pointer that comes, and a second rig; an evaluation of two laws; one of its pieces."""
    folder, rig = tmp_path_factory.mktemp("logs"), Parameters()
    write_recording(folder / "one.rec", example(40, second=True))
    results = []
    for name in ("pid", "backstepping"):
        task = pieces.evaluation_tasks(name, pieces.controller_settings(name, rig), "BirthSIM/Probe-v3", {}, 2, 7)[0]
        result = task.work(**task.settings)
        tasks._write(folder / f"{name}.json", task, result, {})
        results.append(pieces.gathered(name, [result]).to_dict())
    results[0]["episodes"]["hunting_x"][1] = float("nan")
    results[0]["episodes"]["air"] = [np.nextafter(0.1, 1), -0.0]
    write_json(folder / "evaluation.json", {"arguments": {"seed": "7"}, "rig": rig.to_dict(), "results": results})
    return {"recording": folder / "one.rec", "evaluation": folder / "evaluation.json", "piece": folder / "pid.json"}


def bits(values):
    """Numbers to the last bit, all kinds of NaN as one."""
    numbers = np.asarray(values)
    return np.where(numbers == numbers, numbers, np.nan).tobytes() if numbers.dtype.kind == "f" else numbers.tobytes()


def rows_of(log, name):
    return np.concatenate([one.values[name] for one in log.series])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["recording", "evaluation", "piece"])
def test_parquet_gives_every_number_back(kind, files, tmp_path, monkeypatch, capsys):
    out = tmp_path / "a.parquet"
    status, printed, complained = call("export", monkeypatch, capsys, "--to", "parquet", files[kind], "--out", out)
    assert (status, complained) == (0, "")
    log, table = reading.read_log(files[kind]), pq.read_table(out)
    assert printed.startswith(f"written to {out}: {table.num_rows} rows of {len(log.columns)} columns")
    assert table.column_names == [*HEAD, *log.columns]
    for name, (unit, meaning) in log.columns.items():
        assert table.schema.field(name).metadata == {b"unit": unit.encode(), b"description": meaning.encode()}
        assert bits(table.column(name).to_numpy()) == bits(rows_of(log, name)), name
    topics = [one.topic for one in log.series for _ in one.times]
    assert table.column("topic").to_pylist() == topics
    about = json.loads(table.schema.metadata[b"birthsim"])
    assert Parameters.from_dict(json.loads(about["rig"])).to_dict() == log.about["rig"]
    assert json.loads(about["events"]) == [event._asdict() for event in log.events]
    assert [path.name for path in tmp_path.iterdir()] == ["a.parquet"]


@pytest.mark.parametrize("kind", ["recording", "evaluation", "piece"])
def test_mcap_gives_every_finite_number_back(kind, files, tmp_path, monkeypatch, capsys):
    reader = pytest.importorskip("mcap.reader")
    assert call("export", monkeypatch, capsys, "--to", "mcap", files[kind], "--out", tmp_path / "a.mcap")[0] == 0
    log = reading.read_log(files[kind])
    messages = {}
    with (tmp_path / "a.mcap").open("rb") as file:
        mcap = reader.make_reader(file, validate_crcs=True)
        for schema, channel, message in mcap.iter_messages():
            rules = json.loads(schema.data)
            # What Foxglove Studio's parseJsonSchema takes: anything else makes it refuse the channel.
            assert rules["type"] == "object"
            assert {entry["type"] for entry in rules["properties"].values()} <= {"number", "integer", "boolean", "string"}
            assert None not in json.loads(message.data).values()
            messages.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
            if channel.topic == log.series[0].topic:
                units = {name: entry["unit"] for name, entry in rules["properties"].items()}
                assert units == {name: column.unit for name, column in log.columns.items()}
        about = {record.name: record.metadata for record in mcap.iter_metadata()}["birthsim"]
    assert json.loads(about["rig"]) == log.about["rig"]
    for one in log.series:
        found = messages.pop(one.topic)
        assert [now for now, _ in found] == [round(1e9 * time) for time in one.times]
        for name, values in one.values.items():
            told = np.array([said.get(name, np.nan) for _, said in found], dtype=values.dtype)
            assert bits(told) == bits(np.where(np.isfinite(values), values, np.nan).astype(values.dtype)), name
    events = [(topic.removeprefix("/"), now, said) for topic, many in messages.items() for now, said in many]
    expected = [(event.kind, round(1e9 * event.time), {event.kind: json.dumps(event.value)}) for event in log.events]
    assert sorted(events, key=str) == sorted(expected, key=str)


def test_a_log_holds_what_the_file_holds(files):
    recording, log = load_recording(files["recording"]), reading.read_log(files["recording"])
    assert {name: len(ends) for name, (_, _, ends) in reading.FIELDS.items()} == recordings.FIELDS
    assert bits(np.array([log.series[0].values[name] for name in log.columns]).T) == bits(recording.rows)
    assert np.isnan(log.series[0].values["pointer_x"]).any()
    assert {event.kind for event in log.events} == {"settings", "path", "lost"}
    raw, log = json.loads(files["evaluation"].read_text()), reading.read_log(files["evaluation"])
    for result, one in zip(raw["results"], log.series, strict=True):
        assert one.topic == f"/evaluation/{result['controller']}"
        assert one.values["seed"].tolist() == result["seeds"] == [7, 8]
        for name, numbers in result["episodes"].items():
            assert log.columns[name].unit == result["units"][name]
            assert bits(one.values[name]) == bits(np.array(numbers, dtype=float))
        assert {f"return_{discount}" for discount in result["returns"]} <= one.values.keys()
    piece, log = json.loads(files["piece"].read_text())["result"], reading.read_log(files["piece"])
    assert [one.topic for one in log.series] == ["/error/pid/7", "/error/pid/8"]
    found = pieces.gathered("pid", [piece]).traces[0].transpose(1, 2, 0)
    errors = np.array([[one.values["error_x"], one.values["error_y"]] for one in log.series])
    assert bits(errors) == bits(found.copy())
    assert log.series[0].times[1] == pytest.approx(0.01)


def test_results_that_do_not_fit_together_are_refused(files, tmp_path):
    content = json.loads(files["evaluation"].read_text())
    content["results"][0]["lost"].pop()
    write_json(tmp_path / "short.json", content)
    with pytest.raises(ValueError, match=r"short.json' is damaged or foreign: episodes of 'pid' are not as many.*allowed: "):
        reading.read_log(tmp_path / "short.json")


CHANGES = {
    "units are numbers": lambda one: one["results"][0].update(units=dict.fromkeys(one["results"][0]["units"], 1)),
    "a metric has no unit": lambda one: one["results"][0]["units"].popitem(),
    "a list for results": lambda one: one.update(results=[[1]]),
    "no results": lambda one: one.update(results=[]),
    "no episodes": lambda one: one["results"][0].update(seeds=[]),
    "a seed beyond 64 bits": lambda one: one["results"][0]["seeds"].__setitem__(0, 2**64),
    "a list for the rig": lambda one: one.update(rig=[1]),
    "a deep rig": lambda one: one.update(rig=json.loads('{"a":' * 900 + "1" + "}" * 900)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_an_evaluation_of_other_kinds_of_values_is_refused(change, files, tmp_path):
    content = json.loads(files["evaluation"].read_text())
    CHANGES[change](content)
    (tmp_path / "odd.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match=r"odd.json' is damaged.*allowed: "):
        reading.read_log(tmp_path / "odd.json")


@pytest.mark.parametrize("shape", [[], [1], [2, 2], [1, 2, 3], [10**300, 2, 2], [0, 2, 2], "x"])
def test_a_piece_with_another_trace_is_refused(shape, files, tmp_path):
    content = json.loads(files["piece"].read_text())
    content["result"]["trace"]["shape"] = shape
    (tmp_path / "odd.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match=r"odd.json' is damaged.*allowed: "):
        reading.read_log(tmp_path / "odd.json")


@pytest.mark.parametrize("suffix", [".parquet", ".mcap"])
def test_a_log_is_written_whole_or_not_at_all(suffix, files, tmp_path, monkeypatch, capsys):
    """A writer that fails half way leaves the file that was there."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"before")

    def half(log, file):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(writing.WRITERS, suffix, half)
    status, _, complained = call("export", monkeypatch, capsys, "--to", suffix[1:], files["recording"], "--out", path)
    assert status == 2
    assert complained == f"birthsim export: error: {str(path)!r}: No space left on device\n"
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(("suffix", "package"), [(".parquet", "pyarrow"), (".mcap", "mcap.writer")])
def test_without_the_extra_it_says_how_to_get_it(suffix, package, files, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, package, None)
    line = ("--to", suffix[1:], files["recording"], "--out", tmp_path / f"a{suffix}")
    status, _, complained = call("export", monkeypatch, capsys, *line)
    assert status == 2
    assert "pip install -e '.[log]'" in complained
    assert list(tmp_path.iterdir()) == []
