"""What every controller looks like."""

from __future__ import annotations

from typing import Protocol

from birthsim_env.lanes import Array
from birthsim_env.signals import Mask, Measurement, Reference


class Controller(Protocol):
    """A control law, called once per control period.

    ``command`` takes what the sensors say and what is asked for, and returns spool openings in [-1, 1] of the valves of
    chambers P1, N1, P2, N2: (4, N) for signals over N lanes, (4,) for one rig. ``reset`` forgets the past, of all lanes or
    of those where the mask (N,) is True.
    """

    def command(self, measurement: Measurement, reference: Reference) -> Array: ...

    def reset(self, lanes: Mask | None = None) -> None: ...
