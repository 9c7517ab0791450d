"""Recordings: what is played is what was, and what is no recording is refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig import recorder, recording
from birthsim_live.rig.frames import COLUMNS, FIELDS, SLICES
from birthsim_live.rig.hand import Hold
from birthsim_live.rig.player import Player
from birthsim_live.rig.recorder import EVERY, Recorder
from birthsim_live.rig.recording import Recording, load_recording, packed
from birthsim_live.rig.session import Session
from tests.work.test_side_by_side import waited_for

RIG = Parameters().replace({"mechanics.mass": 2.5})


def recorded(path: Path) -> tuple[list[dict[str, Any]], Recorder]:
    """A session with a drag, a change, a reset and a loss; its frames every ``EVERY`` periods and its recorder."""
    session = Session(RIG)
    session.advance(3)
    session.recorder = Recorder(session, path)
    frames = [session.frame()]

    def run(rows: int) -> None:
        for _ in range(rows):
            session.advance(EVERY)
            frames.append(session.frame())

    run(10)
    session.hands.hold = Hold(np.array([0.52, 0.01]), 4)
    run(10)
    session.change({"scenario": "circle", "controller": "pid"})
    run(10)
    session.hands.hold = None
    session.reset()
    run(5)
    session.state[6] = 3e6
    session.advance(EVERY)
    return frames, session.recorder


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    path = tmp_path_factory.mktemp("recordings") / "one.rec"
    frames, recorder = recorded(path)
    recorder.finish()
    return path, frames


def test_what_is_played_is_what_was(file: tuple[Path, list[dict[str, Any]]]) -> None:
    path, frames = file
    assert [place.name for place in path.parent.iterdir()] == ["one.rec"]
    player = Player(load_recording(path))
    assert player.recording.rig == RIG
    assert player.recording.duration == pytest.approx(35 * EVERY * 0.001)
    for k, was in enumerate(frames):
        player.seek(k * EVERY * 0.001)
        now = player.frame()
        assert now["time"] == pytest.approx(k * EVERY * 0.001, abs=1e-9)
        for name in (*FIELDS, "linkage", "force", "rendered"):
            if name != "time" and now[name] != was[name]:
                assert np.allclose(now[name], was[name], rtol=1e-5, atol=1e-9), (k, name)
        assert now["lost"] is None
    player.seek(0.0)
    assert player.event("settings")["controller"] == "admittance-backstepping"
    assert player.event("path") == [[0.5, 0.0]]
    player.seek(25 * EVERY * 0.001)
    assert player.event("settings")["scenario"] == "circle"
    assert len(player.event("path")) > 100


def test_playing_goes_on_to_the_end_and_between_rows(file: tuple[Path, list[dict[str, Any]]]) -> None:
    player = Player(load_recording(file[0]))
    times = []
    while not player.halted:
        assert player.advance(1, 0.0) == 1
        times.append(player.frame()["time"])
    assert np.all(np.diff(times) > 0)
    assert player.position == player.recording.duration
    player.seek(0.010)
    rows = player.recording.rows
    assert player.row()[SLICES["position"]] == pytest.approx((rows[2] + rows[3])[SLICES["position"]] / 2)
    player.seek(1e6)
    assert player.halted
    assert player.event("lost") is None


def test_a_file_from_before_friction_and_flows_plays_without_them(tmp_path: Path) -> None:
    rows = np.random.default_rng(0).uniform(-0.05, 0.05, (3, COLUMNS - 6))
    header = {
        "format": "birthsim-recording-2", "birthsim": "0", "rig": RIG.to_dict(), "columns": list(FIELDS)[:-2],
        "interval": 0.004,
    }  # fmt: skip
    (tmp_path / "old.rec").write_bytes(packed(header) + packed({"events": []}, rows))
    found = load_recording(tmp_path / "old.rec")
    assert np.array_equal(found.rows[:, :-6], rows)
    assert np.isnan(found.rows[:, -6:]).all()
    frame = Player(found).frame()
    assert frame["friction"] == [None, None]
    assert frame["flows"] == [None] * 4


def test_a_loss_is_recorded(tmp_path: Path) -> None:
    session = Session(RIG)
    session.state[6] = 3e6
    session.recorder = Recorder(session, tmp_path / "lost.rec")
    session.advance(EVERY)
    session.recorder.take(session)
    for _ in range(EVERY):
        session.recorder.take(session)
    session.recorder.finish()
    player = Player(load_recording(tmp_path / "lost.rec"))
    player.seek(1.0)
    assert "pressure of chamber P1" in player.frame()["lost"]


def test_a_recording_ends_by_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "LONGEST", 0.1)
    session = Session(RIG)
    session.recorder = Recorder(session, tmp_path / "long.rec")
    session.advance(200)
    assert session.recorder.full
    assert session.recorder.seconds == pytest.approx(0.1)


def rewritten(path: Path, folder: Path, change: Any) -> Path:
    """A copy of a recording, of two chunks, whose header, events and rows ``change`` has seen."""
    whole = load_recording(path)
    header = {
        "format": recording.FORMAT, "birthsim": "0", "rig": whole.rig.to_dict(), "columns": list(FIELDS),
        "interval": whole.interval,
    }  # fmt: skip
    parts = {"header": header, "events": whole.events, "rows": np.hstack([whole.rows, whole.second])}
    change(parts)
    copy = folder / "changed.rec"
    copy.write_bytes(packed(parts["header"]) + packed({"events": parts["events"]}, parts["rows"]))
    return copy


def put(**values: Any) -> Any:
    return lambda parts: parts["header"].update(values)


def events(*listed: Any) -> Any:
    return lambda parts: parts.update(events=list(listed))


DAMAGES = {
    "another format": put(format="birthsim-recording-9"),
    "other columns": put(columns=["time"]),
    "an impossible rig": put(rig={"mechanics": {"mass": -1.0}}),
    "a rig that is none": put(rig=3),
    "no interval": put(interval=0.0),
    "events that are none": events(3),
    "no list of events": lambda parts: parts.update(events=None),
    "an event beyond the end": events({"row": 10**6, "lost": None}),
    "events out of order": events({"row": 5, "lost": None}, {"row": 4, "lost": None}),
    "a path that is none": events({"row": 0, "path": [[1]]}),
    "settings that are none": events({"row": 0, "settings": {"Kclx": [1]}}),
    "an event of another kind": events({"row": 0, "script": "x"}),
    "rows of another size": lambda parts: parts.update(rows=np.zeros((3, 2 * COLUMNS + 1))),
    "no rows": lambda parts: parts.update(rows=np.zeros((0, 2 * COLUMNS)), events=[]),
    "a header that is none": lambda parts: parts.update(header=3),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_foreign_is_refused_by_name(damage: str, file: tuple[Path, Any], tmp_path: Path) -> None:
    copy = rewritten(file[0], tmp_path, DAMAGES[damage])
    with pytest.raises(ValueError, match=r"changed.rec' is damaged or foreign .*; allowed: what birthsim live wrote"):
        load_recording(copy)


def test_what_is_damaged_is_refused_by_name(file: tuple[Path, Any], tmp_path: Path) -> None:
    whole = file[0].read_bytes()
    broken = tmp_path / "broken.rec"
    for content in (b"", b"hello", whole[:100], whole[:200] + bytes(300) + whole[500:], whole + whole[:300] + whole):
        broken.write_bytes(content)
        with pytest.raises(ValueError, match=r"broken.rec' is damaged or foreign"):
            load_recording(broken)
    with pytest.raises(ValueError, match=r"none.rec' cannot be read: No such file"):
        load_recording(tmp_path / "none.rec")


def test_a_file_that_holds_too_much_is_not_unpacked(file: tuple[Path, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    size = file[0].stat().st_size
    for most, words in ((size, f"allowed: up to {size}"), (size - 1, f"allowed: at most {size - 1}")):
        monkeypatch.setattr(recording, "LARGEST", most)
        with pytest.raises(ValueError, match=words):
            load_recording(file[0])


@pytest.mark.parametrize(
    ("limit", "content"),
    [
        ("WORDS", packed({"events": [{"row": 0, "settings": {str(k): 0 for k in range(1000)}}]})),
        ("BRACKETS", packed({"events": [{}] * 1000})),
        ("CHUNKS", packed({"events": []}) * 1000),
    ],
)
def test_json_that_would_take_long_is_refused_before_it_is_read(
    limit: str, content: bytes, file: tuple[Path, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    header = file[0].read_bytes()
    (tmp_path / "long.rec").write_bytes(header + content + packed({"events": [3]}))
    most = {"WORDS": 8000, "BRACKETS": 900, "CHUNKS": 900}[limit]
    assert len(load_recording(file[0]).rows) > 1
    monkeypatch.setattr(recording, limit, most)
    with pytest.raises(ValueError, match=rf"long\.rec'.*allowed: up to {most}"):
        load_recording(tmp_path / "long.rec")


def test_a_recording_ends_before_it_says_more_than_is_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "MOST_WORDS", 2000)
    session = Session(RIG)
    session.recorder = Recorder(session, tmp_path / "busy.rec")
    for k in range(100):
        session.change({"mass": 2.0 + 0.01 * k})
        session.advance(EVERY)
    assert session.recorder.full
    session.recorder.finish()
    assert 1 < len(load_recording(tmp_path / "busy.rec").rows) < 20


def test_what_is_written_is_read_while_the_recording_goes_on(tmp_path: Path) -> None:
    session = Session(RIG)
    running = Recorder(session, tmp_path / "on.rec")
    session.recorder = running
    running.open()
    assert len(load_recording(running.path).rows) == 1
    session.advance(40 * EVERY)
    waited_for(lambda: len(load_recording(running.path).rows) == 41)
    # As a kill may leave it: a part of a chunk.
    whole = running.path.read_bytes()
    torn = tmp_path / "torn.rec"
    for cut in (1, 7, 9, 30):
        torn.write_bytes(whole + packed({"events": []}, np.ones((9, 2 * COLUMNS)))[:cut])
        assert len(load_recording(torn).rows) == 41
    running.finish()
    assert running.path.read_bytes() == whole


def test_a_disk_that_takes_no_more_keeps_what_came_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = Session(RIG)
    running = Recorder(session, tmp_path / "full.rec")
    session.recorder = running
    running.open()
    assert running._file is not None
    real, room = running._file, 100

    class Full:
        """Takes ``room`` bytes and then none."""

        def write(self, content: bytes) -> int:
            nonlocal room
            if not room:
                raise OSError(28, "No space left on device")
            done, room = real.write(content[:room]), 0
            return int(done or 0)

        def __getattr__(self, name: str) -> Any:
            return getattr(real, name)

    monkeypatch.setattr(running, "_file", Full())
    session.advance(10 * EVERY)
    waited_for(lambda: running.full)
    session.advance(10 * EVERY)
    with pytest.raises(OSError, match="No space left"):
        running.finish()
    assert [path.name for path in tmp_path.iterdir()] == ["full.rec"]
    content = running.path.read_bytes()
    assert len(load_recording(running.path).rows) == 1
    assert len(content) == running._length


def test_a_recording_that_cannot_begin_leaves_nothing(tmp_path: Path) -> None:
    session = Session(RIG)
    (tmp_path / "taken.rec").write_bytes(b"another's")
    for place in ("taken.rec", "none/one.rec"):
        with pytest.raises(OSError, match=r"exists|No such file"):
            Recorder(session, tmp_path / place).open()
    assert [path.name for path in tmp_path.iterdir()] == ["taken.rec"]


def test_a_name_that_is_taken_costs_no_row(tmp_path: Path) -> None:
    session = Session(RIG)
    (tmp_path / "taken.rec").write_bytes(b"another's")
    session.recorder = running = Recorder(session, tmp_path / "taken.rec")
    with pytest.raises(FileExistsError):
        running.open()
    session.advance(4 * EVERY)
    running.path = tmp_path / "free.rec"
    running.finish()
    assert len(load_recording(running.path).rows) == 5


def test_a_recording_is_a_value() -> None:
    rows = np.zeros((3, COLUMNS))
    one = Recording(RIG, rows, 0.004, [], np.full_like(rows, np.nan))
    assert one.duration == pytest.approx(0.008)
    assert Player(one).event("settings") is None
