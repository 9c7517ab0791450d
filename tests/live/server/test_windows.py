"""What windows on a running rig are told, and what they may ask for."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.frames import FIELDS
from birthsim_live.rig.session import Session
from birthsim_live.server import live_hub, protocol
from birthsim_live.server.live_hub import LiveHub
from tests.live.server.sockets import SOCKET, client, of, say, until


def test_a_window_is_told_everything_and_then_sees_frames(live: TestClient) -> None:
    with live.websocket_connect(SOCKET) as ws:
        hello = json.loads(ws.receive_text())
        assert (hello["type"], hello["protocol"], hello["mode"]) == ("hello", 1, "live")
        assert [json.loads(ws.receive_text())["type"] for _ in range(4)] == ["settings", "state", "path", "history"]
        assert hello["settings"]["controller"] == "admittance-backstepping"
        titles = {choice["name"]: choice["title"] for choice in hello["choices"]["controller"]}
        assert titles["residual:circle"] == "residual (circle)"
        assert all(choice["about"] for choices in hello["choices"].values() for choice in choices)
        assert set(hello["ranges"]) <= set(hello["settings"])
        assert len(hello["geometry"]["workspace"]) == 66
        assert {"pivot1", "half_stroke1", "bounds", "barrels", "head"} <= set(hello["geometry"])
        first, second = until(ws, of("frame")), until(ws, of("frame"))
        assert set(FIELDS) | {"linkage", "force", "rendered", "error_mm", "pointer_id", "lost", "behind"} <= set(first)
        assert second["n"] > first["n"]
        assert second["time"] >= first["time"]


def test_a_window_that_falls_silent_lets_go(live: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    with live.websocket_connect(SOCKET) as ws:
        say(ws, "drag", position=[0.53, 0.0], id=5)
        assert until(ws, of("state", dragging=True))
        monkeypatch.setattr(live_hub, "PATIENCE", 0.0)
        assert until(ws, of("state", dragging=False))
        assert until(ws, of("frame", pointer=None, force=[0.0, 0.0]))


def test_drag_settings_pause_reset(live: TestClient) -> None:
    with live.websocket_connect(SOCKET) as ws:
        say(ws, "drag", position=[0.53, 0.0], id=5)
        assert until(ws, of("state", dragging=True))
        frame = until(ws, lambda m: m["type"] == "frame" and m["pointer_id"] == 5 and m["drag_force"][0] > 15)
        assert frame["pointer"] == [0.53, 0.0]
        say(ws, "release")
        assert until(ws, of("state", dragging=False))
        say(ws, "set", settings={"Kclx": 4000, "controller": "lqr"})
        assert until(ws, of("settings", Kclx=4000.0, controller="lqr", stiffness_source="sliders"))
        say(ws, "pause", paused=True)
        assert until(ws, of("state", paused=True))
        stood = until(ws, of("frame", real_time=None))["time"]
        assert until(ws, of("frame"))["time"] == stood
        say(ws, "reset")
        assert until(ws, of("frame", time=0.0))
        say(ws, "speed", speed=0.1)
        assert until(ws, of("state", speed=0.1))
        say(ws, "pause", paused=False)
        assert until(ws, lambda m: m["type"] == "frame" and m["time"] > 0.01)
        say(ws, "set", settings={"scenario": "circle"})
        assert len(until(ws, of("path"))["points"]) >= 1


def test_two_windows_push_one_rig_and_a_closed_one_lets_go(live: TestClient) -> None:
    with live.websocket_connect(SOCKET) as first:
        with live.websocket_connect(SOCKET) as second:
            say(second, "drag", position=[0.52, 0.01], id=1)
            assert until(first, of("state", dragging=True))
            say(first, "release")  # not its to release
            say(first, "set", settings={"mass": 4.0})
            assert until(second, of("settings", mass=4.0))
            assert until(first, lambda m: m["type"] == "frame" and m["pointer"] == [0.52, 0.01])
        assert until(first, of("state", dragging=False))
        assert until(first, of("frame", pointer=None))
    with live.websocket_connect(SOCKET) as again:  # a reload
        assert until(again, of("hello", mass=4.0))
        assert until(again, of("frame"))


def test_whatever_is_sent_the_socket_lives_on(live: TestClient) -> None:
    with live.websocket_connect(SOCKET) as ws:
        for sent, words in (
            ("{", "no JSON"),
            ("x" * (protocol.LONGEST + 1), "allowed: up to 16384"),
            ('{"type":"set","settings":{"Kclx":-1}}', "Kclx = -1; allowed: 200 to 8000 N/m"),
            ('{"type":"set","settings":{"Kclx":3000,"stiffness_source":"scenario"}}', "beside Kclx"),
            ('{"type":"drag","position":[NaN,0],"id":1}', "nan"),
            ('{"type":"seek","time":1}', "seek in a live session"),
        ):
            ws.send_text(sent)
            assert words in until(ws, of("error"))["message"]
        ws.send_bytes(b"\x00\xff")
        assert "binary" in until(ws, of("error"))["message"]
        say(ws, "ping", id=17)
        assert until(ws, of("pong", id=17))
        assert until(ws, of("frame"))


def test_a_flood_of_settings_ends_at_the_last(live: TestClient) -> None:
    with live.websocket_connect(SOCKET) as ws:
        for k in range(400):
            say(ws, "set", settings={"Kclx": 1000.0 + k})
            say(ws, "drag", position=[0.5, k / 40000], id=k)
        say(ws, "set", settings={"controller": "pid"})
        assert until(ws, of("settings", Kclx=1399.0, controller="pid"))
        assert until(ws, of("frame", pointer_id=399, lost=None))


def test_windows_choose_a_comparison_by_a_setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_hub, "PATIENCE", math.inf)
    with client(LiveHub(Session(Parameters()), tmp_path)) as live, live.websocket_connect(SOCKET) as ws:
        hello = until(ws, of("hello"))
        assert hello["defaults"]["compare"] == "nothing"
        assert [choice["name"] for choice in hello["choices"]["compare"][:2]] == ["nothing", "backstepping"]
        assert until(ws, of("frame"))["second"] is None
        say(ws, "set", settings={"compare": "nobody"})
        assert "compare = 'nobody'; allowed: nothing, backstepping" in until(ws, of("error"))["message"]
        say(ws, "set", settings={"compare": "backstepping"})
        assert until(ws, of("settings", compare="backstepping"))
        begun = until(ws, lambda m: m["type"] == "frame" and m["second"] is not None)
        assert begun["second"]["time"] == begun["time"]
        say(ws, "push", force=[20, 0], id=5)
        pushed = until(ws, lambda m: m["type"] == "frame" and m["second"]["drag_force"] == [20.0, 0.0])
        assert (pushed["drag_force"], pushed["pointer_id"]) == ([20.0, 0.0], 5)
        say(ws, "release")
        assert until(ws, lambda m: m["type"] == "frame" and m["second"]["drag_force"] == [0.0, 0.0])
        say(ws, "set", settings={"compare": "nothing"})
        assert until(ws, lambda m: m["type"] == "frame" and m["second"] is None)
