"""The commands that serve a page: until they are interrupted, or refuse in one line."""

import signal
import sys
from urllib.request import urlopen

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
