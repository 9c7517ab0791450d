"""A passivity observer at the port between rig and hand (Hannaford and Ryu 2002), from what the sensors tell.

Work is counted about the moving target, between two positions by the trapezoid rule, and twice: with positions that are late
by ``LAG``, and with forces that are late by as much. The hand of an oscillation that goes on neither gives nor takes, and a
count without delay would let it be. With late positions, a hand that is a spring k takes k pi X^2 sin(w LAG) in each cycle of
amplitude X; with late forces, a hand that is a mass does. A rig whose oscillation decays fast enough passes both counts.
"""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array

LAG = 0.008
"""s, time constant of a low-pass, assumed: two samples of the tracker, whose noise it halves."""


class PortEnergy:
    """N lanes; ``update`` is called once per control period."""

    def __init__(self, lanes: int) -> None:
        self._stamp = np.full(lanes, -np.inf)
        self._forces: Array = np.zeros((2, 2, lanes))
        self._offset, self._target = (np.zeros((2, lanes)) for _ in range(2))

    def reset(self, lanes: Mask) -> None:
        """Forget the past of the lanes of a mask (N,)."""
        self._stamp[lanes] = -np.inf

    def update(self, measurement: Measurement, reference: Reference, force: Array) -> tuple[Array, Array, Array, Array]:
        """Takes the hand's ``force``, N, (2, N), when the position was taken. Returns what the hand has done since the last
        call, J, (2, N), in both counts: work about the moving target, and that of a motion as the target's; the target's path
        times the force, J, (2, N); and x - xt, m, (2, N), late by ``LAG``."""
        starts = np.isneginf(self._stamp)
        since = measurement.position_time - self._stamp
        target = reference.position - (measurement.time - measurement.position_time) * reference.velocity
        away = measurement.position - target
        offset = np.where(starts, away, self._offset - np.expm1(-since / LAG) * (away - self._offset))
        # Late by one lag more than the offset.
        slow = self._forces[1] - np.expm1(-since / (2.0 * LAG)) * (force - self._forces[1])
        forces = np.stack([force, np.where(starts, force, slow)])
        new = since > 0.0
        mean, moved = 0.5 * (forces + self._forces) * (new & ~starts), target - self._target
        work, asked = (mean * (offset - self._offset)).sum(axis=1), (mean * moved).sum(axis=1)
        path = np.sqrt((mean**2).sum(axis=1) * (moved**2).sum(axis=0))
        self._stamp = np.where(new, measurement.position_time, self._stamp)
        self._forces = np.where(new, forces, self._forces)
        self._offset, self._target = np.where(new, offset, self._offset), np.where(new, target, self._target)
        return work, asked, path, self._offset
