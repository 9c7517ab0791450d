"""Every kind of fault: what it is, and what may happen then."""

from dataclasses import dataclass
from typing import NamedTuple

CLOSE, VENT, HOLD = "close", "vent", "hold"

ACTIONS = {
    CLOSE: "all valves are closed: the air stays in the chambers, and the head where friction and leakage leave it",
    VENT: "all chambers are let out slowly, so that a head sinks; a 5/3 valve cannot do that, and closes",
    HOLD: "the controller goes on and holds the head where its target was, until the time is over or the fault lasts",
}
"""What an owner may choose, and what it means."""

LASTS = 0.5
"""s: a fault that lasts longer while the controller holds, or another one, closes the valves; assumed."""


class Kind(NamedTuple):
    """What a fault is, and whether the controller can go on to hold: its signals must be good, and the head not in danger.

    A controller would answer a false speed or force with motion."""

    about: str
    may_hold: bool = False


KINDS = {
    "pressure": Kind("a chamber's pressure is outside of its limits"),
    "speed": Kind("the end effector is too fast"),
    "force": Kind("the hand pushes too hard"),
    "workspace": Kind("a piston is too near to its end stop"),
    "deviation": Kind("the end effector is too far from its target", True),
    "missing": Kind("no sample has come"),
    "not finite": Kind("a signal that the controller needs is not a finite number"),
    "frozen": Kind("the rig's clock stands still"),
    "clock": Kind("the rig's clock goes back, or leaps"),
    "blind": Kind("no new position has come"),
    "stuck": Kind("a pressure does not change although its valve is open"),
    "late": Kind("openings were computed too late", True),
    "opening": Kind("the controller's openings are none: not finite, or beyond -1 to 1"),
    "controller": Kind("the controller fails"),
    "read": Kind("the driver fails to read"),
    "write": Kind("the driver fails to write"),
    "rig": Kind("the rig has closed its valves by itself"),
    "start": Kind("no good sample has come at all"),
    "interrupted": Kind("somebody has asked to end", True),
    "hung": Kind("the control loop does not come back, and its process was killed"),
    "killed": Kind("the control loop's process is gone"),
}
"""Kind -> what it is. ``hung`` and ``killed`` are seen by the process that watches; what stops them is the driver's stop()."""

WATCHED = ("hung", "killed")
"""Those that leave no loop that could act."""


@dataclass(frozen=True)
class Fault:
    """A fault of a ``kind`` at ``time``, s since control began. ``said`` has value and what is allowed; ``action`` follows."""

    kind: str
    time: float
    said: str
    action: str

    def words(self) -> str:
        """In a line."""
        about = f"{self.kind}: {KINDS[self.kind].about}; {self.said}" if self.said else f"{self.kind}: {KINDS[self.kind].about}"
        return f"fault after {self.time:.3f} s: {about}; {self.action}"
