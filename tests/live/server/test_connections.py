"""Connections of clients that say nothing, half of it, or what is no text: each is closed, and the others go on."""

import contextlib
import http.client
import logging
import socket
import threading

import pytest
import uvicorn
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import connect

from birthsim_live.server.addresses import listen
from birthsim_live.server.connections import LARGEST, configured
from tests.live.server.test_controller import numbers
from tests.work.test_side_by_side import waited_for

SHORT = 0.3  # s for a request


@pytest.fixture(scope="module")
def port(app):
    with listen("127.0.0.1", 0) as listening:
        server = uvicorn.Server(configured(app("shut-valves"), SHORT))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        waited_for(lambda: server.started)
        yield listening.getsockname()[1]
        server.should_exit = True
        thread.join()


def window(port):
    return connect(f"ws://127.0.0.1:{port}/controller?name=shut-valves")


def answered(ws):
    ws.send(numbers())
    return len(ws.recv()) == 32


HALVES = (
    *(b"", b"GET / HT", b"GET / HTTP/1.1\r\nHost: 127.0.0.1"),
    b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n1",
)


@pytest.mark.parametrize("half", HALVES)
def test_a_request_that_never_ends_is_closed_and_others_are_served(port, half):
    with socket.create_connection(("127.0.0.1", port)) as stranger, window(port) as ws:
        stranger.sendall(half)
        while stranger.recv(1000):
            pass  # an answer to what it has sent so far
        # This window is older than the time for a request.
        assert answered(ws)


def test_half_a_second_request_is_closed_too(port):
    client = http.client.HTTPConnection("127.0.0.1", port)
    for _ in range(2):
        client.request("GET", "/none.js")
        assert client.getresponse().read()
    client.sock.sendall(b"GET /")
    assert client.sock.recv(1) == b""
    client.close()


def test_text_that_is_no_text_closes_its_window_alone_and_quietly(port, caplog):
    logging.getLogger("uvicorn.error").addHandler(caplog.handler)
    with window(port) as other, window(port) as ws:
        ws.send(b"\xff\xfe", text=True)
        with contextlib.suppress(ConnectionClosedError):
            ws.recv()
        assert ws.close_code == 1007
        assert answered(other)
    logging.getLogger("uvicorn.error").removeHandler(caplog.handler)
    assert caplog.records == []


def test_pings_whose_answers_nobody_reads_close_their_socket_alone(port):
    """Ten times what may be left unread, and what the system's own buffers hold."""
    with socket.create_connection(("127.0.0.1", port)) as stranger, window(port) as other:
        stranger.settimeout(60.0)
        asked = f"GET /controller?name=shut-valves HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
        upgrade = (
            f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {'a' * 22}==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        stranger.sendall(f"{asked}{upgrade}".encode())
        assert b"101" in stranger.recv(1000)
        ping = b"\x89" + bytes([0x80 | 125]) + b"\0" * 129
        with pytest.raises(OSError):  # noqa: PT011  reset or broken, as the system has it
            stranger.sendall(400000 * ping)
        assert answered(other)


def test_a_message_that_is_too_large_closes_its_window(port):
    with window(port) as ws:
        ws.send(bytes(LARGEST + 1))
        with contextlib.suppress(ConnectionClosedError):
            ws.recv()
        assert ws.close_code == 1009
