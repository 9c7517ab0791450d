"""The person's hand, which the stage ``outside`` lets act on the rig."""

from __future__ import annotations

import math
from dataclasses import dataclass

from birthsim_build.layout import Inputs
from birthsim_env.physics.compiled.lanes import Array

PATIENCE = 3.0
"""s of wall time, assumed: a hand that has not been heard of for longer lets go; the page tells of one that rests every 0.3 s.
A window that is frozen would pull for ever."""


@dataclass(frozen=True)
class Hold:
    """The person's hand is at ``position`` (2,), m, since the message ``id``: several rigs feel one place of the hand."""

    position: Array
    id: int


@dataclass(frozen=True)
class Push:
    """The person's hand pushes with ``newtons`` (2,) since the message ``id``: several rigs feel one force."""

    newtons: Array
    id: int


class Hands:
    """``hold`` is what the person's hand does, or None, and may be set from another thread; ``felt`` is what it did in the last
    period, and ``used`` is the last hold's id."""

    def __init__(self) -> None:
        self.hold: Hold | Push | None = None
        self.felt: Hold | Push | None = None
        self.used: int | None = None

    def act(self, inputs: Inputs) -> None:
        """Do so from now on."""
        hold = self.felt = self.hold
        inputs.pointer_held[:], inputs.push[:] = float(isinstance(hold, Hold)), 0.0
        if isinstance(hold, Hold):
            inputs.pointer[:, 0] = hold.position
        elif hold:
            inputs.push[:, 0] = hold.newtons
        self.used = hold.id if hold else self.used

    def pointer(self, position: Array, stiffness: float) -> Array | tuple[float, float]:
        """Where the spring from ``position`` (2,), m, ends, or would end for a hand that pushes; NaN where there is no hand."""
        if self.hold is None:
            return math.nan, math.nan
        return self.hold.position if isinstance(self.hold, Hold) else position + self.hold.newtons / stiffness
