"""The step of integration: how long it is, and what the model limits so that an explicit method stays stable with it.

The plant moves by the classical Runge-Kutta method in steps of 0.25 ms. With ``BIRTHSIM_STEP=rk3`` it moves by Ralston's method
of third order in steps of 1/3 ms, which evaluates the equations 9 instead of 16 times a millisecond; ``BIRTHSIM_STEP=fine`` is
the classical method in steps of 1/16 ms, with which both are compared (``birthsim study step``). Everything that is compiled in
a process has the same step: kernels, their derivatives, and code for other targets.
"""

import math
import os
from typing import NamedTuple


class Step(NamedTuple):
    """A step, and what its region of stability allows: real rates down to -2.785 / step of fourth order, -2.513 of third."""

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

    Infinite: not looked at. Only the largest valves on the smallest chambers come near."""

    shortest_tube: float
    """m. The air of a shorter tube has the inertia of one of this length."""

    fastest_tube: float
    """1/s at most of the pressure at a tube's end behind an open valve and close to the pressure beyond it."""


STEPS = {
    "rk4": Step(0.25e-3, 8000.0, 5000.0, 7000.0, math.inf, 0.15, 6000.0),
    "rk3": Step(1e-3 / 3, 4500.0, 3750.0, 6300.0, 6800.0, 0.2, 4500.0),
    "fine": Step(1e-3 / 16, 8000.0, 5000.0, 7000.0, math.inf, 0.15, 6000.0),
}
DEFAULT = "rk4"

METHOD = os.environ.get("BIRTHSIM_STEP") or DEFAULT
"""What the environment variable asks for."""

if METHOD not in STEPS:
    raise ValueError(f"BIRTHSIM_STEP = {METHOD!r}; allowed: {', '.join(STEPS)}")

STEP = STEPS[METHOD]
