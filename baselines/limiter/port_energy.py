"""A passivity observer at the port between rig and hand (Hannaford and Ryu 2002), from what the sensors tell.

Work is counted about the moving target, between two positions by the trapezoid rule, and twice: with positions that are late
by ``LAG``, and with forces that are late by as much. The hand of an oscillation that goes on neither gives nor takes, and a
count without delay would let it be. With late positions, a hand that is a spring k takes k pi X^2 sin(w LAG) in each cycle of
amplitude X; with late forces, a hand that is a mass does. A rig whose oscillation decays fast enough passes both counts.
"""

import math

from birthsim_env.loop.rows import Signals
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows

LAG = 0.008
"""s, time constant of a low-pass, assumed: two samples of the tracker, whose noise it halves."""


class Energy(Rows):
    """What is remembered between two positions."""

    stamp = row("s", "when the last position was taken; minus infinity before the first")
    force = rows("x y", "N", "of the hand then")
    slow = rows("x y", "N", "that force, late by two ``LAG``")
    offset = rows("x y", "m", "of the position from the target, late by ``LAG``")
    target = rows("x y", "m", "of the target then")


class Work(Rows):
    """What the hand has done since the last period, in both counts."""

    done = rows(2, "J", "about the moving target")
    asked = rows(2, "J", "in a motion as the target's")
    path = rows(2, "J", "the force times the target's path")


@helper
def count_work(own: Energy, seen: Signals, force: Array, work: Work, i: int) -> None:
    """Brings lane ``i`` up to a position at which the hand's ``force`` was (2, N), N."""
    late, starts = seen.time[i] - seen.position_time[i], own.stamp[i] == -math.inf
    since, asked = seen.position_time[i] - own.stamp[i], seen.reference
    new = since > 0.0
    gate = 1.0 if new and not starts else 0.0
    offset_gain, force_gain = 1.0 - exact.exp(-since / LAG), 1.0 - exact.exp(-since / (2.0 * LAG))
    for count in range(2):
        work.done[count, i] = work.asked[count, i] = work.path[count, i] = 0.0
    squares = slow_squares = moved_squares = 0.0
    for k in range(2):
        target = asked.position[k, i] - late * asked.velocity[k, i]
        away, moved = seen.position[k, i] - target, target - own.target[k, i]
        offset = away if starts else own.offset[k, i] + offset_gain * (away - own.offset[k, i])
        # Late by one lag more than the offset.
        slow = force[k, i] if starts else own.slow[k, i] + force_gain * (force[k, i] - own.slow[k, i])
        mean, slow_mean = 0.5 * (force[k, i] + own.force[k, i]) * gate, 0.5 * (slow + own.slow[k, i]) * gate
        work.done[0, i] += mean * (offset - own.offset[k, i])
        work.done[1, i] += slow_mean * (offset - own.offset[k, i])
        work.asked[0, i] += mean * moved
        work.asked[1, i] += slow_mean * moved
        squares, slow_squares, moved_squares = squares + mean**2, slow_squares + slow_mean**2, moved_squares + moved**2
        if new:
            own.force[k, i], own.slow[k, i], own.offset[k, i], own.target[k, i] = force[k, i], slow, offset, target
    work.path[0, i], work.path[1, i] = math.sqrt(squares * moved_squares), math.sqrt(slow_squares * moved_squares)
    if new:
        own.stamp[i] = seen.position_time[i]
