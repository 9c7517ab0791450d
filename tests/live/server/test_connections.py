"""Connections of clients that say nothing, half of it, or what is no text: each is closed, and the others go on."""

from __future__ import annotations

import contextlib
import http.client
import json
import logging
import socket
import threading
from collections.abc import Iterator

import pytest
import uvicorn
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import ClientConnection, connect

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.commands.serving import request_time
from birthsim_live.rig.session import Session
from birthsim_live.server.addresses import listen
from birthsim_live.server.app import create_app
from birthsim_live.server.connections import configured
from birthsim_live.server.live_hub import LiveHub
from tests.work.test_side_by_side import waited_for

SHORT = 0.3  # s for a request


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """A server as the command makes it, in a thread."""
    app = create_app(LiveHub(Session(Parameters()), tmp_path_factory.mktemp("recordings")))
    with listen("127.0.0.1", 0) as listening:
        server = uvicorn.Server(configured(app, SHORT))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        waited_for(lambda: server.started)
        yield listening.getsockname()[1]
        server.should_exit = True
        thread.join()


def window(port: int) -> ClientConnection:
    return connect(f"ws://127.0.0.1:{port}/ws", max_size=None)


def answered(ws: ClientConnection, identity: int) -> bool:
    ws.send(json.dumps({"type": "ping", "id": identity}))
    return any(json.loads(text) == {"type": "pong", "id": identity} for text in ws)


HALVES = [
    b"",
    b"GET / HT",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1",
    b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n1",
]


@pytest.mark.parametrize("half", HALVES)
def test_a_request_that_never_ends_is_closed_and_others_are_served(port: int, half: bytes) -> None:
    with socket.create_connection(("127.0.0.1", port)) as stranger, window(port) as ws:
        stranger.sendall(half)
        while stranger.recv(1000):
            pass  # an answer to what it has sent so far
        # This window is older than the time for a request.
        assert answered(ws, 1)


def test_half_a_second_request_is_closed_too(port: int) -> None:
    client = http.client.HTTPConnection("127.0.0.1", port)
    for _ in range(2):
        client.request("GET", "/static/none.js")
        assert client.getresponse().read()
    client.sock.sendall(b"GET /")
    assert client.sock.recv(1) == b""
    client.close()


def test_text_that_is_no_text_closes_its_window_alone_and_quietly(port: int, caplog: pytest.LogCaptureFixture) -> None:
    logging.getLogger("uvicorn.error").addHandler(caplog.handler)
    with window(port) as other, window(port) as ws:
        ws.send(b"\xff\xfe", text=True)
        with contextlib.suppress(ConnectionClosedError):
            for _ in ws:
                pass  # frames on their way
        assert ws.close_code == 1007
        assert answered(other, 2)
    logging.getLogger("uvicorn.error").removeHandler(caplog.handler)
    assert caplog.records == []


@pytest.mark.parametrize("text", ["0", "-1", "nan", "1e9", "soon"])
def test_the_time_for_a_request_is_a_number_of_seconds(text: str) -> None:
    with pytest.raises(Exception, match=rf"{text}.*allowed: a"):
        request_time(text)
