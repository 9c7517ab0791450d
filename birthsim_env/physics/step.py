"""The step of integration: how long it is, and what the model limits so that an explicit method stays stable with it.

The plant moves by Ralston's Runge-Kutta method of third order in steps of 1/3 ms, which evaluates the equations nine times a
millisecond. Kinks, where friction reverses or a valve shuts, limit the accuracy: a fourth order buys little.
"""

from typing import NamedTuple


class Step(NamedTuple):
    """A step, and what its region of stability allows: real rates down to -2.513 / step."""

    seconds: float
    """s: the longest step."""

    relaxation_limit: float
    """1/s. A bristle relaxes at s0 |v| / G; above this rate it has long slid, and the rate is held."""

    elasto_plastic_limit: float
    """1/s. The same for the elasto-plastic law, whose rate falls several times more steeply as alpha rises."""

    fastest_rate: float
    """1/s. Damping over mass of a rod at most; the spring of the bristles takes the rest of what is stable."""

    fastest_air: float
    """1/s at most of a chamber's pressure at the end of the stroke, behind an open valve and close to the pressure beyond it.

    Only the largest valves on the smallest chambers come near."""

    shortest_tube: float
    """m. The air of a shorter tube has the inertia of one of this length."""

    fastest_tube: float
    """1/s at most of the pressure at a tube's end behind an open valve and close to the pressure beyond it."""


STEP = Step(1e-3 / 3, 4500.0, 3750.0, 6300.0, 6800.0, 0.2, 4500.0)
