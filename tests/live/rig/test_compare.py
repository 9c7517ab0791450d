"""Two rigs under one hand: the second is what a session of its own would be, in frames, recordings, logs and messages."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birthsim_build.layout import DRAG_DAMPING, DRAG_LIMIT
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.reading import read_log
from birthsim_live.rig.frames import COLUMNS, FIELDS, SLICES, frame_of
from birthsim_live.rig.hand import Hold, Push
from birthsim_live.rig.player import Player
from birthsim_live.rig.recorder import EVERY, Recorder
from birthsim_live.rig.recording import FIRST_COLUMNS, load_recording, packed
from birthsim_live.rig.session import Session
from birthsim_live.rig.settings import opening_settings

RIG = Parameters()
FIRST, SECOND = "backstepping", "admittance-backstepping"
HANDS = [Hold(np.array([0.53, 0.01]), 1), None, Push(np.array([20.0, -5.0]), 2), None]


def session(**settings: Any) -> Session:
    return Session(RIG, opening_settings(RIG).model_copy(update=settings))


def same(one: Array, other: Array) -> bool:
    return np.array_equal(one, other, equal_nan=True)


@pytest.mark.parametrize("world", [{"scenario": "circle", "scenario_force": True, "sensors": "lab"}, {"valves": "one_valve"}])
def test_both_rigs_are_bit_for_bit_what_each_would_be_alone(world: dict[str, Any]) -> None:
    both, first, second = session(), session(), session(controller=SECOND)
    both.advance(100)
    for one in (first, second):
        one.change(world)
        one.reset()
    both.change(world)
    both.change({"compare": SECOND})
    assert both.time == 0.0
    assert both.second is not None
    for k, hand in enumerate(HANDS):
        for one in (both, first, second):
            one.hands.hold = hand
            one.change({"Kclx": 1500.0 + 500.0 * k, "mass": 3.0 + 0.2 * k, "damping": 1.0 + 0.1 * k})
            one.advance(150)
        assert same(both.row(), first.row())
        assert same(both.second.row(), second.row())
    frame = both.frame()
    assert frame["second"]["error_mm"] == frame_of(second.row(), RIG)["error_mm"] != frame["error_mm"]


def test_what_is_compared_starts_anew_and_all_else_goes_on() -> None:
    one = session(compare=SECOND, scenario="circle")
    assert one.second is not None
    one.advance(50)
    for changes in ({"friction": 0.5}, {"scenario": "descent"}, {"scenario_force": True}, {"sensors": "lab"}):
        time = one.time
        one.change(changes)
        assert one.time == time
        one.advance(20)
        assert one.second.time == one.time
        assert same(one.second.row()[SLICES["target"]], one.row()[SLICES["target"]])
    for changes in ({"controller": "pid"}, {"compare": "lqr"}):
        one.advance(20)
        one.change(changes)
        assert (one.time, one.second.time) == (0.0, 0.0)
        assert same(one.second.state, one.state)
    assert (one.settings.controller, one.second.settings.controller) == ("pid", "lqr")
    one.advance(20)
    one.change({"compare": "nothing"})
    assert one.second is None
    assert one.time == pytest.approx(0.02)
    assert one.frame()["second"] is None


def test_a_controller_beside_itself_does_the_same() -> None:
    one = session(compare=FIRST)
    one.hands.hold = HANDS[0]
    one.advance(300)
    assert one.second is not None
    assert same(one.second.row(), one.row())


def test_a_place_of_the_hand_pulls_each_head_by_its_own_spring_and_a_push_pushes_both_alike() -> None:
    one = session(compare=SECOND)
    assert one.second is not None
    one.hands.hold = Hold(np.array([0.54, 0.0]), 1)
    one.advance(800)
    rows = [one.row(), one.second.row()]
    assert same(rows[0][SLICES["pointer"]], rows[1][SLICES["pointer"]])
    for row in rows:
        motion = row[SLICES["position"]], row[SLICES["velocity"]]
        assert same(row[SLICES["drag_force"]], 1000.0 * (one.hands.hold.position - motion[0]) - DRAG_DAMPING * motion[1])
    pulls = [row[SLICES["drag_force"]][0] for row in rows]
    assert pulls[0] > pulls[1] + 1  # dry friction keeps the first head back, so that its spring pulls harder
    one.hands.hold = Push(np.array([20.0, 0.0]), 2)
    one.advance(10)
    for row in (one.row(), one.second.row()):
        assert row[SLICES["drag_force"]].tolist() == [20.0, 0.0]
        assert row[SLICES["pointer"]] == pytest.approx(row[SLICES["position"]] + [0.02, 0.0])
    one.hands.hold = Push(np.array([90.0, 90.0]), 3)
    one.advance(1)
    assert one.row()[SLICES["drag_force"]] == pytest.approx([DRAG_LIMIT / math.sqrt(2)] * 2)


def test_both_stand_still_where_one_is_lost() -> None:
    one = session(compare=SECOND)
    assert one.second is not None
    one.advance(5)
    one.second.state[6] = 3e6
    one.advance(5)
    frame = one.frame()
    assert frame["lost"] is None
    assert "pressure of chamber P1" in frame["second"]["lost"]
    assert one.halted
    assert one.advance(5) == 0
    one.reset()
    assert one.advance(5) == 5


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """A recording that begins alone and ends beside another rig, which is lost, and its frames."""
    path = tmp_path_factory.mktemp("recordings") / "two.rec"
    one = session()
    one.recorder = Recorder(one, path)
    frames = [one.frame()]
    for k in range(20):
        if k == 10:
            one.change({"compare": SECOND})
            one.hands.hold = HANDS[0]
        one.advance(EVERY)
        frames.append(one.frame())
    assert one.second is not None
    one.second.state[6] = 3e6
    one.advance(1)
    for _ in range(EVERY):
        one.recorder.take(one)
    one.recorder.finish()
    return path, frames


def test_a_recording_holds_both_rigs(recorded: tuple[Path, list[dict[str, Any]]]) -> None:
    path, frames = recorded
    player = Player(load_recording(path))
    for k, was in enumerate(frames):
        player.seek(k * EVERY * 0.001)
        now = player.frame()["second"]
        assert (now is None) == (was["second"] is None)
        if now is not None:
            for name in FIELDS:
                if name != "time":
                    assert now[name] == was["second"][name], (k, name)
            assert now["lost"] is None
    assert player.event("settings")["compare"] == SECOND
    player.seek(1.0)
    assert "pressure of chamber P1" in player.frame()["second"]["lost"]
    assert player.frame()["lost"] is None


def test_a_log_has_the_second_rig_as_a_topic_of_its_own(recorded: tuple[Path, list[dict[str, Any]]]) -> None:
    first, second = read_log(recorded[0]).series
    assert (first.topic, second.topic) == ("/rig", "/second_rig")
    assert len(first.times) == 22
    assert second.times[0] == pytest.approx(11 * EVERY * 0.001)
    assert second.values["position_x"][0] == pytest.approx(0.5, abs=1e-3)


def test_a_recording_of_one_rig_of_before_is_still_played(tmp_path: Path) -> None:
    one = session()
    rows = []
    for _ in range(5):
        one.advance(EVERY)
        rows.append(one.row())
    header = {
        "format": "birthsim-recording-2", "birthsim": "0.9", "rig": RIG.to_dict(), "columns": FIRST_COLUMNS, "interval": 0.004,
    }  # fmt: skip
    path = tmp_path / "old.rec"
    held = SLICES[FIRST_COLUMNS[-1]].stop
    path.write_bytes(packed(header) + packed({"events": []}, np.array(rows)[:, :held]))
    recording = load_recording(path)
    assert same(recording.rows[:, :held], np.array(rows)[:, :held])
    assert np.isnan(recording.rows[:, held:]).all()
    assert recording.second.shape == (5, COLUMNS)
    assert Player(recording).frame()["second"] is None
    assert [one.topic for one in read_log(path).series] == ["/rig"]
