"""An acceleration sensor at the end effector, on two axes.

It feels the mean acceleration of the control period that has just ended, behind a first-order low-pass. Gravity is taken off:
the angles of the rig are known to a few mrad from its positions, and what that leaves, 10 m/s2 times those, counts as bias.
"""

from __future__ import annotations

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

TICK, ROWS = 4, 5
"""Velocity a period ago, m/s, and low-passed acceleration, m/s2, of both axes; in row ``TICK`` the control period of the last
look."""

NOISE = 11
"""First of the two channels of random numbers, in all sensor models."""


def passed(bandwidth: float, period: float) -> float:
    """Fraction of a change that passes a low-pass (Hz) in a ``period``, s; 0 for a bandwidth of 0, which is no sensor."""
    return 1.0 - exact.number("exp", -6.283185307179586 * bandwidth * period)


@helper
def looked(memory: Array, i: int, tick: int) -> bool:
    """Whether lane ``i`` of ``memory`` (ROWS, N) has been measured in this period before: it is where others begin anew."""
    before = tick > 0 and memory[TICK, i] == tick
    memory[TICK, i] = tick
    return before


@helper
def feel(
    memory: Array, i: int, axis: int, tick: int, velocity: float, gain: float, bias: float, period: float, share: float,
    again: bool,
) -> float:  # fmt: skip
    """Carries ``memory`` (ROWS, N) of lane ``i`` on by one ``period``, s; returns the acceleration without noise, m/s2.

    ``share`` is that of ``passed``. ``again`` is what ``looked`` says; the memory stays as it is then. Where an episode begins
    nothing is known of the motion before it, and the acceleration is taken for zero.
    """
    if not again:
        before = velocity if tick == 0 else memory[axis, i]
        felt = (1.0 + gain) * ((velocity - before) / period) + bias
        memory[axis, i] = velocity
        memory[2 + axis, i] = felt if tick == 0 else memory[2 + axis, i] + share * (felt - memory[2 + axis, i])
    low_passed: float = memory[2 + axis, i]
    return low_passed
