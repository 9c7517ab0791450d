"""A browser, a rig and a window on it, for the tests of the page."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tests.live.browser import CALM, PATIENCE, Server, Window


@pytest.fixture(scope="session")
def served(tmp_path_factory):
    with Server("live", "--record-dir", tmp_path_factory.mktemp("recordings")) as running:
        yield running


@pytest.fixture
def server(served):
    """The run's server; its rig begins anew, whatever a test that failed has left."""
    from websockets.sync.client import connect

    with connect(f"{served.url.replace('http', 'ws')}ws", open_timeout=PATIENCE) as socket:
        defaults = json.loads(socket.recv())["defaults"]
        settings = {name: value for name, value in defaults.items() if not name.startswith("K")}
        for message in (
            {"type": "set", "settings": settings},
            {"type": "speed", "speed": 1},
            {"type": "pause", "paused": False},
            {"type": "reset"},
            {"type": "ping", "id": 1},
        ):
            socket.send(json.dumps(message))
        while (said := json.loads(socket.recv()))["type"] != "pong":
            assert said["type"] != "error", said
    return served


@pytest.fixture
def window(chromium, server):
    """A window on a rig that runs and that nobody holds."""
    with Window(chromium, server.url + CALM) as opened:
        opened.wait(f"birthsim.settings.controller === '{CALM.partition('=')[2]}'")
        opened.wait("birthsim.frame.pointer === null && birthsim.frame.lost === null && !birthsim.state.paused")
        yield opened
        assert opened.complaints == []
        assert opened.foreign == []


@pytest.fixture(scope="session")
def pictures(tmp_path_factory):
    """Folder for screenshots: BIRTHSIM_SCREENSHOTS, or one that pytest throws away."""
    folder = Path(os.environ.get("BIRTHSIM_SCREENSHOTS") or tmp_path_factory.mktemp("screenshots"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder
