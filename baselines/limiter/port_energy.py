"""A passivity observer at the port between rig and hand (Hannaford and Ryu 2002), from what the sensors tell.

Positions come late and at times of their own, so the force is taken at the time stamp of each position, on a straight
line between the control periods on either side, and the work between two positions by the trapezoid rule.
"""

from __future__ import annotations

import math

import numpy as np

from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array

LONGEST_DELAY = 0.06
"""s: the oldest position whose force is still known; the longest latency that ``Electronics`` allows is 0.05 s."""


LAG = 0.005


class PortEnergy:
    """N lanes; ``update`` is called once per control period of ``period`` s."""

    def __init__(self, period: float, lanes: int) -> None:
        self._stamp = np.full(lanes, -np.inf)
        self._force, self._place, self._target = (np.zeros((2, lanes)) for _ in range(3))

    def reset(self, lanes: Mask) -> None:
        """Forget the past of the lanes of a mask (N,)."""
        self._stamp[lanes] = -np.inf

    def update(self, measurement: Measurement, reference: Reference, force: Array) -> tuple[Array, Array, Array]:
        """Work, J, (N,), that the hand has done since the last call, that which it would have done had it moved as the target,
        and x - xt, m, (2, N), at the newest position."""
        starts = np.isneginf(self._stamp)
        late = measurement.time - measurement.position_time
        target = reference.position - late * reference.velocity
        new = measurement.position_time > self._stamp
        mean = 0.5 * (force + self._force) * (new & ~starts)
        gain = -np.expm1(-(measurement.position_time - self._stamp) / LAG) if LAG > 0 else np.ones_like(late)
        place = np.where(starts, measurement.position, self._place + gain * (measurement.position - self._place))
        work = (mean * (place - self._place)).sum(axis=0)
        asked = (mean * (target - self._target)).sum(axis=0)
        path = np.sqrt((mean**2).sum(axis=0) * ((target - self._target)**2).sum(axis=0))
        self._stamp = np.where(new, measurement.position_time, self._stamp)
        self._force = np.where(new, force, self._force)
        self._place, self._target = np.where(new, place, self._place), np.where(new, target, self._target)
        return work, asked, self._place - self._target, path
