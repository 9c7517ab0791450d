"""A recording as something that moves in time, as the rig did."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_live.rig.frames import SLICES, frame_of
from birthsim_live.rig.recording import EVENTS, Recording

ROUNDING = 1e-6
"""Of the time between two rows: nearer to a row than that is at it."""


class Player:
    """Plays a recording from ``position``, s since its first row; it is ``halted`` at its end."""

    period = 0.001

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.position = 0.0
        self._events: dict[str, tuple[list[int], list[Any]]] = {}
        for kind in EVENTS:
            events = [event for event in recording.events if kind in event]
            self._events[kind] = [event["row"] for event in events], [event[kind] for event in events]

    @property
    def halted(self) -> bool:
        return self.position >= self.recording.duration

    def advance(self, periods: int, until: float) -> int:
        """Go on by so many ms."""
        self.seek(self.position + periods * self.period)
        return periods

    def seek(self, time: float) -> None:
        """Go to ``time``, s; beyond the end is the end."""
        self.position = min(max(time, 0.0), self.recording.duration)

    def event(self, kind: str) -> Any:
        """What was last noted of a kind (``recording.EVENTS``) at the present row; None where nothing was."""
        rows, values = self._events[kind]
        k = bisect_right(rows, self._place()[0])
        return values[k - 1] if k else None

    def row(self) -> Array:
        """The present instant, between two rows on a straight line; its time is that of the recording."""
        return self._between(self.recording.rows)

    def frame(self) -> dict[str, Any]:
        """The present instant as the page shows it."""
        second = self._between(self.recording.second)
        there = bool(np.isfinite(second[SLICES["episode_time"]]).all())
        return {**self._shown(self.row(), "lost"), "second": self._shown(second, "second_lost") if there else None}

    def _shown(self, row: Array, lost: str) -> dict[str, Any]:
        return {**frame_of(row, self.recording.rig), "pointer_id": None, "lost": self.event(lost)}

    def _between(self, rows: Array) -> Array:
        k, part = self._place()
        here, there = rows[k], rows[min(k + 1, len(rows) - 1)]
        # A pointer that is not there (NaN) before or after is not there between, and neither is a second rig.
        row: Array = here + part * (there - here) if part > ROUNDING else here.copy()
        row[SLICES["time"]] = self.position
        return row

    def _place(self) -> tuple[int, float]:
        """The row before the present instant, and how far it is to the next."""
        place = self.position / self.recording.interval + ROUNDING / 2
        return int(place), place % 1.0
