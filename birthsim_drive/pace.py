"""The computer's clock as the pace of a loop, for rigs that are polled."""

import time

SPIN = 1e-4
"""s before a tick from which the clock is watched instead of slept on; assumed: a sleeping process wakes some 60 us late."""


class Pace:
    """Ticks of a ``period``, s, from the first ``wait`` on.

    A tick that was missed by more than a period is skipped, so that a loop that was late does not hurry afterwards.

    Examples
    --------
    >>> pace = Pace(0.001)
    >>> ticks = [pace.wait() for _ in range(3)]
    >>> ticks[0], ticks == sorted(set(ticks))
    (0, True)
    """

    def __init__(self, period: float) -> None:
        self._period, self._begun, self._tick = period, 0.0, -1

    def wait(self) -> int:
        """Sleep until the next tick; returns its number, from 0 on."""
        now = time.perf_counter()
        if self._tick < 0:
            self._begun = now
        self._tick = max(self._tick + 1, int((now - self._begun) / self._period))
        due = self._begun + self._tick * self._period
        if due - now > SPIN:
            time.sleep(due - now - SPIN)
        while time.perf_counter() < due:
            pass
        return self._tick
