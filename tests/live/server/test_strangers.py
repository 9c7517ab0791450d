"""What strangers meet: foreign hosts and origins, and addresses that are not served."""

from __future__ import annotations

from pathlib import Path

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.session import Session
from birthsim_live.server.addresses import is_loopback, listen
from birthsim_live.server.app import create_app
from birthsim_live.server.live_hub import LiveHub
from tests.live.server.sockets import HERE, SOCKET, of, until

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
