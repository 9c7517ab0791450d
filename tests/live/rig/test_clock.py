"""Pace without a clock: what is due, what is dropped, and what is said about it; and the thread, without timing."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from birthsim_live.rig.clock import MOST_LAG, Clock, Pace
from tests.console import PATIENCE


def test_what_is_due_follows_the_wall_and_the_speed() -> None:
    pace = Pace(0.001)
    pace.restart(10.0)
    assert pace.due(10.004, 1.0) == 4
    pace.ran(4, 10.005)
    assert pace.due(10.008, 0.25) == 1
    pace.ran(1, 10.009)
    assert pace.behind == 0.0


def test_a_hiccup_is_caught_up_with_and_more_is_dropped_and_said() -> None:
    pace = Pace(0.001)
    pace.restart(0.0)
    assert pace.due(0.04, 1.0) == 40
    pace.ran(10, 0.05)
    assert pace.due(0.05, 1.0) == 40
    pace.ran(40, 0.06)
    assert pace.due(1.06, 1.0) == round(MOST_LAG / 0.001) + 1
    assert pace.behind == pytest.approx(1.01 - MOST_LAG - 0.001)
    pace.restart(2.0)
    assert pace.behind == 0.0
    assert pace.due(2.0, 1.0) == 0


def test_lag_in_slow_motion_is_wall_time() -> None:
    pace = Pace(0.001)
    pace.restart(0.0)
    pace.due(1.0, 0.1)
    assert pace.behind == pytest.approx(1.0 - MOST_LAG - 0.01)


def test_the_factor_is_that_of_the_last_second() -> None:
    pace, now = Pace(0.001), 0.0
    pace.restart(now)
    assert pace.factor(1.0) is None
    for _ in range(2000):  # a machine that runs half of what is due
        now += 0.004
        pace.ran(min(pace.due(now, 1.0), 2), now)
    assert pace.factor(1.0) == pytest.approx(0.5, rel=0.01)
    assert pace.behind == pytest.approx(now / 2, rel=0.02)
    for _ in range(300):
        now += 0.004
        pace.ran(4, now)
    assert pace.factor(1.0) == pytest.approx(1.0, rel=0.01)
    assert pace.factor(0.5) == pytest.approx(2.0, rel=0.01)


class Counter:
    """Something that moves."""

    period = 0.001

    def __init__(self) -> None:
        self.count, self.halted, self.broken = 0, False, False

    def advance(self, periods: int, until: float) -> int:
        if self.broken:
            raise RuntimeError("broken")
        self.count += periods
        return periods

    def frame(self) -> dict[str, Any]:
        return {"count": self.count}


def test_the_thread_moves_pauses_and_answers(caplog: pytest.LogCaptureFixture) -> None:
    source, moved, frames = Counter(), threading.Event(), []

    def on_frame(frame: dict[str, Any]) -> None:
        frames.append(frame)
        if frame["count"] > 20:
            moved.set()

    clock = Clock(source, on_frame)
    clock.start()
    try:
        assert moved.wait(PATIENCE)
        clock.ask(lambda: clock.pause(True)).result(PATIENCE)
        stood = source.count
        assert clock.ask(lambda: source.count).result(PATIENCE) == stood
        with pytest.raises(ZeroDivisionError):
            clock.ask(lambda: 1 // 0).result(PATIENCE)
        assert [frame["n"] for frame in frames] == list(range(1, len(frames) + 1))
        source.broken = True
        clock.ask(lambda: clock.pause(False)).result(PATIENCE)
        while not clock.paused:  # ends, or the test run's own limit does
            clock.ask(lambda: None).result(PATIENCE)
        assert "the rig stopped" in caplog.text
    finally:
        clock.stop()
    assert not clock.is_alive()
    late = clock.ask(lambda: 5)
    clock.stop()  # nobody waits for ever
    assert late.result(PATIENCE) == 5
