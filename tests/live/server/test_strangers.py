"""What strangers meet: foreign hosts and origins, and addresses that are not served."""

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from birthsim_live.server.addresses import host_name, is_loopback, listen
from tests.live.server.conftest import HERE
from tests.live.server.test_controller import SOCKET, numbers

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
def test_foreign_hosts_and_origins_are_refused(live, headers, status):
    reply = live.get("/main.js", headers=headers)
    assert reply.status_code == status
    if status == 200:
        with live.websocket_connect(SOCKET + "shut-valves", headers=headers) as ws:
            ws.send_bytes(numbers())
            assert len(ws.receive_bytes()) == 32
        return
    assert "foreign" in reply.text
    with pytest.raises(WebSocketDisconnect), live.websocket_connect(SOCKET + "shut-valves", headers=headers) as ws:
        ws.receive_text()


NAMED = [
    ({"host": "rig.example:9000", "origin": "http://rig.example:9000"}, 200),
    ({"host": "RIG.example", "origin": "https://rig.example"}, 200),
    ({"host": "127.0.0.1:8000"}, 200),
    ({"host": "other.example"}, 403),
    ({"host": "rig.example:9000", "origin": "http://rig.example:3000"}, 403),
    ({"host": "rig.example:9000", "origin": "http://other.example"}, 403),
    ({"host": "127.0.0.1:8000", "origin": "https://rig.example"}, 403),
]


@pytest.mark.parametrize(("headers", "status"), NAMED)
def test_a_name_that_is_allowed_opens_page_and_socket(app, headers, status):
    with TestClient(app("shut-valves", hosts=("127.0.0.1", "rig.example")), base_url=HERE) as one:
        reply = one.get("/main.js", headers=headers)
        assert reply.status_code == status
        if status == 200:
            with one.websocket_connect(SOCKET + "shut-valves", headers=headers) as ws:
                ws.send_bytes(numbers())
                assert len(ws.receive_bytes()) == 32
        else:
            assert "Host" in reply.text or "rig.example" in reply.text
            with pytest.raises(WebSocketDisconnect), one.websocket_connect(SOCKET + "shut-valves", headers=headers) as ws:
                ws.receive_text()


def test_a_refusal_names_the_option_that_lets_a_host_in(live):
    assert "--allowed-host NAME" in live.get("/", headers={"host": "localhost.example"}).text


def test_names_of_hosts():
    good = {
        "rig.example": "rig.example",
        "RIG": "rig",
        "10.0.0.7": "10.0.0.7",
        "[::1]": "::1",
        "::1": "::1",
        " a-b.c ": "a-b.c",
    }
    assert {text: host_name(text) for text in good} == good
    assert host_name("b\u00fccher.example") == "xn--bcher-kva.example"
    odd = (
        "",
        " ",
        "http://rig.example",
        "rig.example:8000",
        "rig.example/",
        "*",
        "*.example",
        "a b",
        "a,b",
        "..",
        "a" * 300,
        "[",
    )
    for text in odd:
        with pytest.raises(ValueError, match=r"--allowed-host .*; allowed: a name or address alone"):
            host_name(text)


def test_every_address_is_served_under_names_alone():
    for host in ("0.0.0.0", "::"):
        with pytest.raises(ValueError, match=r"--allowed-host"):
            listen(host, 0)
    with listen("0.0.0.0", 0, named=True) as listening:
        assert listening.getsockname()[1] > 0


def test_a_host_of_ones_own_is_the_only_one(app):
    with TestClient(app(hosts=("rig.example",)), base_url="http://rig.example:8000") as one:
        assert one.get("/nothing").status_code == 404
        assert one.get("/nothing", headers={"host": "127.0.0.1:8000"}).status_code == 403


def test_pages_may_only_use_what_is_served_here(live):
    for place in ("/", "/none.js"):
        headers = live.get(place).headers
        assert headers["content-security-policy"] == "frame-ancestors 'none'"
        assert headers["x-content-type-options"] == "nosniff"
    assert "content=\"default-src 'none'; script-src 'self' 'wasm-unsafe-eval'" in live.get("/").text
    for place in ("/docs", "/openapi.json", "/../pack.py", "/%2e%2e/pack.py", "/rig/../../pack.py"):
        assert live.get(place).status_code == 404


def test_addresses():
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ValueError, match=rf"port = {port} of 127.0.0.1 cannot be served \(.*\); allowed: a free port"):
            listen("127.0.0.1", port)
    for host in ("0.0.0.0", "::", "", "no such host"):
        with pytest.raises(ValueError, match=rf"host = '{host}' (means every address|is unknown)"):
            listen(host, 0)
    hosts = ("127.0.0.1", "::1", "localhost", "192.168.1.5", "localhost.evil.example")
    assert [is_loopback(host) for host in hosts] == [True, True, True, False, False]
