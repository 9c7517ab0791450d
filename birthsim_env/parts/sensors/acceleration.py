"""An acceleration sensor at the end effector, on two axes.

It measures the mean acceleration of the control period that has just ended, behind a first-order low-pass. Gravity is taken
off: positions give the angles of the rig to a few mrad, and what that leaves, 10 m/s2 times those, counts as bias.
"""

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
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


@helper
def looked(memory: Accelerometer, i: int, tick: int) -> bool:
    """Whether lane ``i`` has been measured in this period before: it is where others begin anew."""
    before = tick > 0 and memory.tick[i] == tick
    memory.tick[i] = tick
    return before


@helper
def feel(
    memory: Accelerometer, i: int, axis: int, tick: int, velocity: float, gain: float, bias: float, period: float, share: float,
    again: bool,
) -> float:  # fmt: skip
    """Carries the ``memory`` of lane ``i`` on by one ``period``, s; returns the acceleration without noise, m/s2.

    ``share`` is that of ``passed``. ``again`` is what ``looked`` says; the memory stays as it is then. Where an episode begins
    nothing is known of the motion before it, and the acceleration is taken for zero.
    """
    if not again:
        before = velocity if tick == 0 else memory.velocity[axis, i]
        now = (1.0 + gain) * ((velocity - before) / period) + bias
        memory.velocity[axis, i] = velocity
        last = memory.low_passed[axis, i]
        memory.low_passed[axis, i] = now if tick == 0 else last + share * (now - last)
    low_passed: float = memory.low_passed[axis, i]
    return low_passed
