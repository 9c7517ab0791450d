"""What a window that joins is shown of the time before it came."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.session import Session
from birthsim_live.server.live_hub import LiveHub
from birthsim_live.server.past import PLOTTED, Past
from tests.live.server.sockets import SOCKET, client, of, until


def test_a_window_that_joins_sees_the_time_before(tmp_path: Path) -> None:
    with client(LiveHub(Session(Parameters()), tmp_path)) as live, live.websocket_connect(SOCKET) as first:
        assert until(first, lambda m: m["type"] == "frame" and m["time"] > 0.3)
        with live.websocket_connect(SOCKET) as second:
            times = [frame["time"] for frame in until(second, of("history"))["frames"]]
            assert times[0] < 0.05
            assert times[-1] > 0.2
            assert (np.diff(times) > 0.02).all()


def test_the_past_is_ten_seconds_and_forgets_what_a_reset_undoes() -> None:
    past, frame = Past(), dict.fromkeys(PLOTTED, 0.0)
    for k in range(2000):
        past.take({**frame, "time": 0.01 * k})
    times = [one["time"] for one in past.message()["frames"]]
    assert times[-1] - times[0] == pytest.approx(10.0, abs=0.05)
    past.take({**frame, "time": 0.0})
    assert [one["time"] for one in past.message()["frames"]] == [0.0]
