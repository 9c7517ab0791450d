"""Recordings: what is read is what was written, and what is no recording is refused by name."""

import numpy as np
import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs import recording
from birthsim_live.logs.recording import COLUMNS, FIELDS, load_recording, packed
from tests.live.recordings.made import INTERVAL, events_of, example, header_of, write_recording

RIG = Parameters().replace({"mechanics.mass": 2.5})


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "one.rec", example(36), RIG)


@pytest.mark.parametrize("second", [False, True])
def test_what_is_read_is_what_was_written(second, tmp_path):
    rows = example(36, second)
    found = load_recording(write_recording(tmp_path / "one.rec", rows, RIG))
    assert found.rig == RIG
    assert found.duration == pytest.approx(35 * INTERVAL)
    assert np.array_equal(found.rows, rows[:, :COLUMNS], equal_nan=True)
    assert np.array_equal(found.second, rows[:, COLUMNS:], equal_nan=True)
    assert np.isfinite(found.second).any() == second
    assert found.events == events_of(36)


def test_a_file_from_before_friction_and_flows_is_read_without_them(tmp_path):
    rows = np.random.default_rng(0).uniform(-0.05, 0.05, (3, COLUMNS - 6))
    header = {**header_of(RIG), "format": "birthsim-recording-2", "columns": list(FIELDS)[:-2]}
    (tmp_path / "old.rec").write_bytes(packed(header) + packed({"events": []}, rows))
    found = load_recording(tmp_path / "old.rec")
    assert np.array_equal(found.rows[:, :-6], rows)
    assert np.isnan(found.rows[:, -6:]).all()


def test_a_file_that_ends_early_is_read_as_far_as_it_goes(file, tmp_path):
    """As a kill may leave it: a part of a chunk."""
    for cut in (1, 7, 9, 30):
        (tmp_path / "torn.rec").write_bytes(file.read_bytes() + packed({"events": []}, np.ones((9, 2 * COLUMNS)))[:cut])
        assert len(load_recording(tmp_path / "torn.rec").rows) == 36


DAMAGES = {
    "another format": {"format": "birthsim-recording-9"},
    "other columns": {"columns": ["time"]},
    "an impossible rig": {"rig": {"mechanics": {"mass": -1.0}}},
    "a rig that is none": {"rig": 3},
    "no interval": {"interval": 0.0},
    "events that are none": {"events": [3]},
    "no list of events": {"events": None},
    "an event beyond the end": {"events": [{"row": 10**6, "lost": None}]},
    "events out of order": {"events": [{"row": 5, "lost": None}, {"row": 4, "lost": None}]},
    "a path that is none": {"events": [{"row": 0, "path": [[1]]}]},
    "settings that are none": {"events": [{"row": 0, "settings": {"Kclx": [1]}}]},
    "an event of another kind": {"events": [{"row": 0, "script": "x"}]},
    "rows of another size": {"rows": np.zeros((3, 2 * COLUMNS + 1))},
    "no rows": {"rows": np.zeros((0, 2 * COLUMNS)), "events": []},
    "a header that is none": {"header": 3},
}
"""What differs of the header, the events and the rows."""


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_foreign_is_refused_by_name(damage, file, tmp_path):
    whole, change = load_recording(file), DAMAGES[damage]
    header = {name: change.get(name, value) for name, value in header_of(whole.rig).items()}
    parts = {"header": header, "events": whole.events, "rows": np.hstack([whole.rows, whole.second]), **change}
    (tmp_path / "changed.rec").write_bytes(packed(parts["header"]) + packed({"events": parts["events"]}, parts["rows"]))
    with pytest.raises(ValueError, match=r"changed.rec' is damaged or foreign .*; allowed: what birthsim live wrote"):
        load_recording(tmp_path / "changed.rec")


def test_what_is_damaged_is_refused_by_name(file, tmp_path):
    whole = file.read_bytes()
    broken = tmp_path / "broken.rec"
    for content in (b"", b"hello", whole[:100], whole[:200] + bytes(300) + whole[500:], whole + whole[:300] + whole):
        broken.write_bytes(content)
        with pytest.raises(ValueError, match=r"broken.rec' is damaged or foreign"):
            load_recording(broken)


def test_a_file_that_holds_too_much_is_not_unpacked(file, monkeypatch):
    size = file.stat().st_size
    for most, words in ((size, f"allowed: up to {size}"), (size - 1, f"allowed: at most {size - 1}")):
        monkeypatch.setattr(recording, "LARGEST", most)
        with pytest.raises(ValueError, match=words):
            load_recording(file)


LONG = [
    ("WORDS", 8000, packed({"events": [{"row": 0, "settings": {str(k): 0 for k in range(1000)}}]})),
    ("BRACKETS", 900, packed({"events": [{}] * 1000})),
    ("CHUNKS", 900, packed({"events": []}) * 1000),
]


@pytest.mark.parametrize(("limit", "most", "content"), LONG)
def test_json_that_would_take_long_is_refused_before_it_is_read(limit, most, content, file, tmp_path, monkeypatch):
    (tmp_path / "long.rec").write_bytes(file.read_bytes() + content + packed({"events": [3]}))
    assert len(load_recording(file).rows) > 1
    monkeypatch.setattr(recording, limit, most)
    with pytest.raises(ValueError, match=rf"long\.rec'.*allowed: up to {most}"):
        load_recording(tmp_path / "long.rec")
