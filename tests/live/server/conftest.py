"""A live server for the tests of this folder."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.session import Session
from birthsim_live.server import live_hub
from birthsim_live.server.live_hub import LiveHub
from tests.live.server.sockets import client


@pytest.fixture
def live(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    # However slowly this machine computes, a hand is not let go because it says nothing.
    monkeypatch.setattr(live_hub, "PATIENCE", math.inf)
    with client(LiveHub(Session(Parameters()), tmp_path), tmp_path) as one:
        yield one
