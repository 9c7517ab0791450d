"""Real time: a thread that lets simulated time keep pace with the wall's, and says what it could not."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar

T = TypeVar("T")

SLICE = 0.004
"""s of wall time, about: the newest pointer and settings count from the next slice on."""

BREATH = 0.001
"""s of rest after each slice, however late it is: a slow controller must leave the interpreter to the windows' thread."""

FRAME, IDLE_FRAME = 1 / 75, 0.1
"""s between frames, in motion (oftener than a screen shows them, so that jitter leaves none without a new one) and at rest."""

MOST_LAG = 0.05
"""s of wall time, assumed: what is lost in a hiccup is caught up with up to that; the rest is dropped and reported."""

WINDOW = 1.0
"""s over which the real-time factor is taken."""

SLOWEST = 0.05
"""Least speed, of real time."""

LOG = logging.getLogger("birthsim_live")


class Pace:
    """How many control periods are due; all times are given to it."""

    def __init__(self, period: float) -> None:
        self._period = period
        self.restart(0.0)

    def restart(self, now: float) -> None:
        """Count from ``now``, s, on, with nothing dropped."""
        self.behind = 0.0
        self.skip(now)

    def skip(self, now: float) -> None:
        """Let what went by until ``now``, s, be no lag: the rig stood still."""
        self._last, self._due = now, 0.0
        self._run: deque[tuple[float, float]] = deque([(now, 0.0)])

    def due(self, now: float, speed: float) -> int:
        """Control periods to run at ``now``, s; what exceeds ``MOST_LAG`` is added to ``behind``, s of wall time."""
        self._due += (now - self._last) * speed
        self._last = now
        most = MOST_LAG * speed + self._period
        if self._due > most:
            self.behind += (self._due - most) / speed
            self._due = most
        return int(self._due / self._period + 1e-6)

    def ran(self, periods: int, now: float) -> None:
        """Take note of periods that have run by ``now``, s."""
        self._due -= periods * self._period
        self._run.append((now, self._run[-1][1] + periods * self._period))
        while len(self._run) > 2 and self._run[1][0] <= now - WINDOW:
            self._run.popleft()

    def factor(self, speed: float) -> float | None:
        """Simulated time over wall time times ``speed`` in the last second; None before a tenth of it has gone by."""
        (begun, from_), (ended, to) = self._run[0], self._run[-1]
        return (to - from_) / ((ended - begun) * speed) if ended - begun > WINDOW / 10 else None


class Source(Protocol):
    """What moves in time: a rig, or a recording. ``halted`` says that it cannot go on."""

    period: float

    @property
    def halted(self) -> bool: ...

    def advance(self, periods: int, until: float) -> int: ...

    def frame(self) -> dict[str, Any]: ...


class Clock(threading.Thread):
    """Runs a source in real time and hands every frame to ``on_frame``, both in a thread of its own.

    ``paused`` and ``speed`` may be read at any time; what changes them or the source is done by ``ask``, between two slices.
    """

    def __init__(self, source: Source, on_frame: Callable[[dict[str, Any]], None]) -> None:
        super().__init__(name="birthsim live clock", daemon=True)
        self.paused, self.speed = False, 1.0
        self._source, self._on_frame = source, on_frame
        self._asked: deque[Callable[[], None]] = deque()
        self._wake, self._stopped = threading.Event(), False
        self._pace = Pace(source.period)
        self._frames = 0

    def ask(self, action: Callable[[], T]) -> Future[T]:
        """Let ``action`` run between two slices; its result or its exception comes with the future."""
        future: Future[T] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                future.set_result(action())
            except Exception as error:
                future.set_exception(error)

        self._asked.append(run)
        self._wake.set()
        return future

    def pause(self, paused: bool) -> None:
        """Stand still or go on; to be asked for."""
        self.paused = paused
        if not paused:
            self.restart()

    def restart(self) -> None:
        """Forget what was dropped; to be asked for."""
        self._pace.restart(time.perf_counter())

    def set_speed(self, speed: float) -> None:
        """Run at ``speed`` times real time; to be asked for."""
        self.speed = speed
        self._pace.skip(time.perf_counter())

    def stop(self) -> None:
        """End the thread and wait for it."""
        self._stopped = True
        self._wake.set()
        if self.is_alive() and threading.current_thread() is not self:
            self.join()
        while self._asked:
            self._asked.popleft()()

    def run(self) -> None:
        """Slice after slice, until ``stop``."""
        self._pace.restart(time.perf_counter())
        shown, unshown = 0.0, True
        while not self._stopped:
            news = bool(self._asked)
            while self._asked:
                self._asked.popleft()()
            begun = time.perf_counter()
            running = not (self.paused or self._source.halted)
            if running:
                self._advance(begun)
            else:
                self._pace.skip(begun)
            unshown = unshown or news
            now = time.perf_counter()
            between = FRAME if running or unshown else IDLE_FRAME
            if now >= shown + between:
                # From when it was due, so that lateness does not add up, unless it is a frame late already.
                shown, unshown = max(shown + between, now - between), False
                self._emit(running)
            self._wake.wait(max(BREATH, begun + SLICE - time.perf_counter()))
            self._wake.clear()

    def _advance(self, now: float) -> None:
        periods = self._pace.due(now, self.speed)
        try:
            ran = self._source.advance(periods, now + 2 * SLICE) if periods else 0
        except Exception:
            # A fault of the program must not leave a page that stands still without a word.
            LOG.exception("the rig stopped; the page waits")
            self.paused = True
            return
        self._pace.ran(ran, time.perf_counter())

    def _emit(self, running: bool) -> None:
        frame = self._source.frame()
        self._frames += 1
        factor = self._pace.factor(self.speed) if running else None
        real_time = None if factor is None else round(factor, 4)
        self._on_frame(
            {"type": "frame", "n": self._frames, **frame, "real_time": real_time, "behind": round(self._pace.behind, 4)}
        )
