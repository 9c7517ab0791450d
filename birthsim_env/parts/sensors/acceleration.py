"""An acceleration sensor at the end effector, on two axes.

It measures the mean acceleration of the control period that has just ended, behind a first-order low-pass. Gravity is taken
off: positions give the angles of the rig to a few mrad, and what that leaves, 10 m/s2 times those, counts as bias.
"""

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.records import Rows, row, rows


class Accelerometer(Rows):
    """What the sensor remembers."""

    velocity = rows("x y", "m/s", "of the end effector a period ago")
    low_passed = rows("x y", "m/s2", "acceleration behind the low-pass")
    tick = row("1", "control period of the last look")


NOISE = 11
"""First of the two channels of random numbers, in all sensor models."""


def passed(bandwidth: float, period: float) -> float:
    """Fraction of a change that passes a low-pass (Hz) in a ``period``, s; 0 for a bandwidth of 0, which is no sensor."""
    return 1.0 - exact.number("exp", -6.283185307179586 * bandwidth * period)
