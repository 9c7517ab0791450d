"""Recordings: what is played is what was, and what is no recording is refused by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birthsim_env.physics.parameters import Parameters
from birthsim_live.rig import recording
from birthsim_live.rig.frames import COLUMNS, FIELDS, SLICES
from birthsim_live.rig.hand import Hold
from birthsim_live.rig.player import Player
from birthsim_live.rig.recording import EVERY, Recorder, Recording, load_recording
from birthsim_live.rig.session import Session

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
    path = tmp_path_factory.mktemp("recordings") / "one.npz"
    frames, recorder = recorded(path)
    recorder.save()
    return path, frames


def test_what_is_played_is_what_was(file: tuple[Path, list[dict[str, Any]]]) -> None:
    path, frames = file
    assert [place.name for place in path.parent.iterdir()] == ["one.npz"]
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


def test_a_loss_is_recorded(tmp_path: Path) -> None:
    session = Session(RIG)
    session.state[6] = 3e6
    session.recorder = Recorder(session, tmp_path / "lost.npz")
    session.advance(EVERY)
    session.recorder.take(session)
    for _ in range(EVERY):
        session.recorder.take(session)
    session.recorder.save()
    player = Player(load_recording(tmp_path / "lost.npz"))
    player.seek(1.0)
    assert "pressure of chamber P1" in player.frame()["lost"]


def test_a_recording_ends_by_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "LONGEST", 0.1)
    session = Session(RIG)
    session.recorder = Recorder(session, tmp_path / "long.npz")
    session.advance(200)
    assert session.recorder.full
    assert session.recorder.seconds == pytest.approx(0.1)


def rewritten(path: Path, folder: Path, change: Any) -> Path:
    """A copy of a recording whose rows and header ``change`` has seen."""
    with np.load(path, allow_pickle=False) as content:
        rows, header = content["rows"], json.loads(str(content["header"]))
    arrays = {"rows": rows, "header": header}
    change(arrays)
    if isinstance(arrays["header"], dict):
        arrays["header"] = np.array(json.dumps(arrays["header"]))
    copy = folder / "changed.npz"
    np.savez(copy, **arrays)
    return copy


def put(**values: Any) -> Any:
    return lambda arrays: arrays["header"].update(values)


DAMAGES = {
    "another format": put(format="birthsim-recording-9"),
    "other columns": put(columns=["time"]),
    "an impossible rig": put(rig={"mechanics": {"mass": -1.0}}),
    "a rig that is none": put(rig=3),
    "no interval": put(interval=0.0),
    "events that are none": put(events=[3]),
    "an event beyond the end": put(events=[{"row": 10**6, "lost": None}]),
    "events out of order": put(events=[{"row": 5, "lost": None}, {"row": 4, "lost": None}]),
    "a path that is none": put(events=[{"row": 0, "path": [[1]]}]),
    "settings that are none": put(events=[{"row": 0, "settings": {"Kclx": [1]}}]),
    "an event of another kind": put(events=[{"row": 0, "script": "x"}]),
    "rows of another size": lambda arrays: arrays.update(rows=np.zeros((3, COLUMNS + 1))),
    "rows of another kind": lambda arrays: arrays.update(rows=np.zeros((3, COLUMNS), dtype=np.float32)),
    "no rows": lambda arrays: arrays.update(rows=np.zeros((0, COLUMNS))),
    "a pickle": lambda arrays: arrays.update(header=np.array([{"format": 1}], dtype=object)),
    "a header that is no JSON": lambda arrays: arrays.update(header=np.array("{")),
    "something else too": lambda arrays: arrays.update(more=np.zeros(3)),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_foreign_is_refused_by_name(damage: str, file: tuple[Path, Any], tmp_path: Path) -> None:
    copy = rewritten(file[0], tmp_path, DAMAGES[damage])
    with pytest.raises(ValueError, match=r"changed.npz' is damaged or foreign .*; allowed: what birthsim-live wrote"):
        load_recording(copy)


def test_what_is_damaged_is_refused_by_name(file: tuple[Path, Any], tmp_path: Path) -> None:
    whole = file[0].read_bytes()
    broken = tmp_path / "broken.npz"
    for content in (b"", b"hello", whole[: len(whole) // 2], whole[:200] + bytes(300) + whole[500:]):
        broken.write_bytes(content)
        with pytest.raises(ValueError, match=r"broken.npz' is damaged or foreign"):
            load_recording(broken)
    with pytest.raises(ValueError, match=r"none.npz' cannot be read: No such file"):
        load_recording(tmp_path / "none.npz")


def test_a_file_that_claims_too_much_is_not_unpacked(file: tuple[Path, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "LARGEST", 1000)
    with pytest.raises(ValueError, match="allowed: up to 1000"):
        load_recording(file[0])


def test_an_interrupted_save_leaves_no_half_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = Session(RIG)
    recorder = Recorder(session, tmp_path / "half.npz")

    def fail(*_: Any, **__: Any) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="no space"):
        recorder.save()
    assert not (tmp_path / "half.npz").exists()


def test_a_recording_is_a_value() -> None:
    rows = np.zeros((3, COLUMNS))
    assert Recording(RIG, rows, 0.004, []).duration == pytest.approx(0.008)
    assert Player(Recording(RIG, rows, 0.004, [])).event("settings") is None
