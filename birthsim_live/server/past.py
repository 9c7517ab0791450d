"""What a window that joins must see of the time before: the frames that its plots are drawn from."""

from __future__ import annotations

from collections import deque
from typing import Any

from birthsim_live.rig.frames import frame_of
from birthsim_live.rig.player import Player

PLOTTED = (
    "time", "position", "velocity", "target", "compliant", "force", "stiffness", "rendered", "pneumatic", "pneumatic_setpoint",
    "pressures", "error_mm",
)  # fmt: skip
"""What plots need of a frame."""

SPAN, GAP = 10.0, 0.025
"""s that are kept of a rig, and s between its frames at least: a plot has no room for more."""

MOST = 1500
"""Frames of a whole recording."""


class Past:
    """The last ``SPAN`` seconds of a rig; ``frames`` are in the order of their times."""

    def __init__(self) -> None:
        self._frames: deque[dict[str, Any]] = deque()

    def take(self, frame: dict[str, Any]) -> None:
        """Take note of a frame; a time that runs back, by a reset, takes away what came after it."""
        time = frame["time"]
        while self._frames and self._frames[-1]["time"] > time:
            self._frames.pop()
        if self._frames and time - self._frames[-1]["time"] < GAP:
            return
        self._frames.append(plotted(frame))
        while time - self._frames[0]["time"] > SPAN:
            self._frames.popleft()

    def message(self) -> dict[str, Any]:
        """It as news."""
        return {"type": "history", "frames": list(self._frames)}


def plotted(frame: dict[str, Any]) -> dict[str, Any]:
    """What plots need of a frame and of the rig beside it."""
    second = frame.get("second")
    return {**{name: frame[name] for name in PLOTTED}, "second": second and plotted(second)}


def whole(player: Player) -> dict[str, Any]:
    """News of a whole recording: ``MOST`` of its rows at most, evenly spaced."""
    recording = player.recording
    step = -(-len(recording.rows) // MOST)
    frames = []
    for k in range(0, len(recording.rows), step):
        frame, second = (frame_of(rows[k], recording.rig) for rows in (recording.rows, recording.second))
        frame["second"] = None if second["time"] is None else second
        frames.append({**plotted(frame), "time": round(k * recording.interval, 6)})
    return {"type": "history", "frames": frames}
