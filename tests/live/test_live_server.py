"""The server as browsers and strangers meet it."""

from __future__ import annotations

import json
import math
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.frames import FIELDS, SLICES
from birthsim_live.rig.player import Player
from birthsim_live.rig.recording import Recording, load_recording
from birthsim_live.rig.session import Session
from birthsim_live.server import live_hub, protocol
from birthsim_live.server.addresses import is_loopback, listen
from birthsim_live.server.app import create_app
from birthsim_live.server.live_hub import LiveHub
from birthsim_live.server.replay_hub import ReplayHub
from tests.console import PATIENCE, call, run

HERE = "http://127.0.0.1:8000"
SOCKET = "ws://127.0.0.1:8000/ws"
MESSAGES = 100_000
"""That are waited through, for half an hour and more: frames come on all the while."""


def client(hub: Any, folder: Path | None = None, **options: Any) -> TestClient:
    return TestClient(create_app(hub, recordings=folder, **options), base_url=HERE)


@pytest.fixture
def live(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    # However slowly this machine computes, a hand is not let go because it says nothing.
    monkeypatch.setattr(live_hub, "PATIENCE", math.inf)
    with client(LiveHub(Session(Parameters()), tmp_path), tmp_path) as one:
        yield one


def until(ws: WebSocketTestSession, wanted: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    """The first message that is ``wanted``."""
    for _ in range(MESSAGES):
        message: dict[str, Any] = json.loads(ws.receive_text())
        if wanted(message):
            return message
    raise AssertionError("it never came")


def of(kind: str, **values: Any) -> Callable[[dict[str, Any]], bool]:
    """Messages of a kind with these values, themselves or in their settings."""
    return lambda m: m["type"] == kind and all({**m, **m.get("settings", {})}.get(k) == v for k, v in values.items())


def say(ws: WebSocketTestSession, kind: str, **fields: Any) -> None:
    ws.send_text(json.dumps({"type": kind, **fields}))


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


HEADERS = [
    ({"host": "evil.example"}, 403),
    ({"host": "evil.example:8000", "origin": "http://evil.example:8000"}, 403),
    ({"host": "127.0.0.1.evil.example"}, 403),
    ({"host": "127.0.0.1:8000", "origin": "http://evil.example"}, 403),
    ({"host": "127.0.0.1:8000", "origin": "http://127.0.0.1:3000"}, 403),
    ({"host": "127.0.0.1:8000", "origin": "null"}, 403),
    ({"host": "[", "origin": "http://["}, 403),
    ({"host": "127.0.0.1:8000", "origin": HERE}, 200),
    ({"host": "localhost:8000", "origin": "http://localhost:8000"}, 200),
    ({"host": "[::1]:8000"}, 200),
]


@pytest.mark.parametrize(("headers", "status"), HEADERS)
def test_foreign_hosts_and_origins_are_refused(live: TestClient, headers: dict[str, str], status: int) -> None:
    reply = live.get("/recordings/none.rec", headers=headers)
    assert reply.status_code == (404 if status == 200 else 403)
    if status == 200:
        with live.websocket_connect(SOCKET, headers=headers) as ws:
            assert until(ws, of("hello"))
        return
    assert "foreign" in reply.text
    with pytest.raises(WebSocketDisconnect), live.websocket_connect(SOCKET, headers=headers) as ws:
        ws.receive_text()


def test_a_host_of_ones_own_is_the_only_one(tmp_path: Path) -> None:
    hub = LiveHub(Session(Parameters()), tmp_path)
    with TestClient(create_app(hub, ("rig.example",)), base_url="http://rig.example:8000") as one:
        assert one.get("/nothing").status_code == 404
        assert one.get("/nothing", headers={"host": "127.0.0.1:8000"}).status_code == 403


def test_pages_may_only_use_what_is_served_here(live: TestClient) -> None:
    for place in ("/", "/static/none.js", "/recordings/none.rec"):
        headers = live.get(place).headers
        assert headers["content-security-policy"].startswith("default-src 'self'")
        assert headers["x-content-type-options"] == "nosniff"
    assert live.get("/docs").status_code == live.get("/openapi.json").status_code == 404
    assert live.get("/static/../server.py").status_code == 404
    assert live.get("/static/%2e%2e/server.py").status_code == 404


def test_addresses() -> None:
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ValueError, match=rf"port = {port} of 127.0.0.1 cannot be served \(.*\); allowed: a free port"):
            listen("127.0.0.1", port)
    for every in ("0.0.0.0", "::", ""):
        with pytest.raises(ValueError, match=r"allowed: one address or name|is unknown"):
            listen(every, 0)
    with pytest.raises(ValueError, match=r"host = 'no such host' is unknown"):
        listen("no such host", 0)
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("192.168.1.5")
    assert not is_loopback("localhost.evil.example")


def test_the_command_serves_and_finishes_its_recording_at_an_interrupt(tmp_path: Path) -> None:
    from websockets.sync.client import connect

    command = [sys.executable, "-m", "birthsim_live.commands.live", "--port", "0", "--record-dir", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            line = next(line for line in process.stdout if "http://" in line)
            address = line.split()[1]
            with connect(address.replace("http", "ws") + "/ws", open_timeout=PATIENCE) as ws:
                assert json.loads(ws.recv())["type"] == "hello"
                ws.send('{"type":"record","on":true}')
                while not (message := json.loads(ws.recv())).get("recording"):
                    pass
                ws.send("x" * 100_000)
                while json.loads(ws.recv())["type"] != "error":
                    pass
                process.send_signal(signal.SIGINT)
                rest = process.stdout.read()
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
    assert f"recording finished: {tmp_path / message['recording']['file']}" in rest
    assert "Traceback" not in rest
    assert load_recording(tmp_path / message["recording"]["file"]).rows.shape[0] >= 1


def test_without_the_extra_it_says_how_to_get_it_before_anything_is_compiled(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.setattr("birthsim_live.rig.session.Session", None)
    for command, arguments in (("live", []), ("replay", ["pull.rec"])):
        status, _, complained = call(command, monkeypatch, capsys, *arguments)
        assert status == 2
        assert "pip install 'birthsim[live]'" in complained


def test_commands_refuse_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for arguments, words in (
            (["--port", port], f"port = {port} of 127.0.0.1 cannot be served"),
            (["--host", "0.0.0.0", "--port", "0"], "host = '0.0.0.0' means every address"),
        ):
            status, _, complained = call("live", monkeypatch, capsys, *arguments)
            assert status == 2
            assert complained.strip().splitlines()[-1].startswith("birthsim-live: error: ")
            assert words in complained
    done = run("replay", tmp_path / "none.rec")
    assert done.returncode == 2
    assert done.stderr.strip().splitlines()[-1].startswith("birthsim-replay: error: ")
    assert "none.rec' cannot be read" in done.stderr
