"""The commands that serve a page: until they are interrupted, or refuse in one line."""

import signal
import sys
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from tests.console import PATIENCE
from tests.live.browser import Server


@pytest.mark.slow
def test_the_command_serves_until_an_interrupt_and_leaves_nothing(tmp_path, monkeypatch):
    host = "127.0.0.2" if sys.platform == "linux" else "127.0.0.1"  # others lack the rest of 127.0.0.0/8
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with Server("live", "--host", host) as server:
        assert server.url == f"http://{host}:{server.port}/"
        with urlopen(f"{server.url}rig/loop.wasm") as answer:
            assert answer.read(4) == b"\0asm"
        server.process.send_signal(signal.SIGINT)
        assert "Traceback" not in server.process.stdout.read()
        assert server.process.wait(PATIENCE) == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_behind_a_published_port_it_is_opened_by_the_names_that_are_allowed():
    """As in a container: on every address, under names of the machine outside."""
    with Server("live", "--host", "0.0.0.0", "--allowed-host", "Rig.example", "--allowed-host", "localhost") as server:
        assert server.url == f"http://rig.example:{server.port}/"

        def opened(host):
            return urlopen(Request(f"http://127.0.0.1:{server.port}/", headers={"Host": host}))

        for host in ("rig.example:9000", "localhost:8000"):
            with opened(host) as answer:
                assert answer.status == 200
        for host in ("0.0.0.0:8000", "127.0.0.1"):
            with pytest.raises(HTTPError, match="403") as refused:
                opened(host)
            with refused.value as answer:
                assert b"--allowed-host NAME" in answer.read()
