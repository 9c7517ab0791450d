"""Recordings that a server makes, gives away and plays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient, WebSocketTestSession

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.frames import SLICES
from birthsim_live.rig.player import Player
from birthsim_live.rig.recording import Recording, load_recording
from birthsim_live.rig.session import Session
from birthsim_live.server.live_hub import LiveHub
from birthsim_live.server.replay_hub import ReplayHub
from tests.live.server.sockets import SOCKET, client, of, say, until


def test_recording_download_and_replay(live: TestClient, tmp_path: Path) -> None:
    with live.websocket_connect(SOCKET) as ws:
        say(ws, "record", on=True)
        name = until(ws, lambda m: m["type"] == "state" and m["recording"])["recording"]["file"]
        say(ws, "drag", position=[0.52, 0.0], id=1)
        pulled = until(ws, lambda m: m["type"] == "frame" and m["drag_force"][0] > 5)
        # A frame may be newer than the last row that is written.
        assert until(ws, lambda m: m["type"] == "frame" and m["time"] > pulled["time"] + 0.1)
        say(ws, "record", on=False)
        assert until(ws, of("state", recording=None, last_recording=name))
    reply = live.get(f"/recordings/{name}")
    assert reply.status_code == 200
    assert reply.content == (tmp_path / name).read_bytes()
    for foreign in ("../secret.rec", "..%2fsecret.rec", "none.rec", "one.txt"):
        assert live.get(f"/recordings/{foreign}").status_code == 404
    recording = load_recording(tmp_path / name)
    player = Player(recording)
    hub = ReplayHub(player, "one.rec")
    with client(hub) as replay:
        assert replay.get("/").status_code == 200  # it is served, and nobody has come to see it
        assert hub.clock.paused
        assert player.position == 0.0
        with replay.websocket_connect(SOCKET) as ws:
            _is_played(ws, recording)


def _is_played(ws: WebSocketTestSession, recording: Recording) -> None:
    hello = until(ws, of("hello"))
    whole = until(ws, of("history"))["frames"]
    assert whole[-1]["time"] == pytest.approx(recording.duration)
    assert hello["state"]["file"] == "one.rec"
    assert hello["mode"] == "replay"
    assert hello["state"]["duration"] == recording.duration
    assert hello["settings"]["scenario"] == "probe"
    end = until(ws, of("state", paused=True))  # it plays to its end by itself
    assert end["duration"] == recording.duration
    say(ws, "pause", paused=True)
    say(ws, "seek", time=0.0)
    assert until(ws, lambda m: m["type"] == "frame" and m["time"] == 0.0)["pointer"] is None
    row = int(np.argmax(recording.rows[:, SLICES["drag_force"]][:, 0]))
    say(ws, "seek", time=row * recording.interval)
    assert until(ws, lambda m: m["type"] == "frame" and m["pointer"])["drag_force"][0] > 5
    for kind, fields in (("reset", {}), ("record", {"on": True}), ("set", {"settings": {}})):
        say(ws, kind, **fields)
        assert f"{kind} in a replay; allowed: pause, speed, seek" in until(ws, of("error"))["message"]


def test_a_running_recording_is_finished_when_the_server_ends(tmp_path: Path) -> None:
    with (
        client(LiveHub(Session(Parameters()), tmp_path), tmp_path) as one,
        one.websocket_connect(SOCKET) as ws,
    ):
        say(ws, "record", on=True)
        name = until(ws, lambda m: m["type"] == "state" and m["recording"])["recording"]["file"]
    assert load_recording(tmp_path / name).rows.shape[0] >= 1


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with client(LiveHub(Session(Parameters()), tmp_path / "file")) as one, one.websocket_connect(SOCKET) as ws:
        say(ws, "record", on=True)
        assert "exists" in until(ws, of("error"))["message"]
