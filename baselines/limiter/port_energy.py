"""A passivity observer at the port between rig and hand (Hannaford and Ryu 2002), from what the sensors tell.

Positions come late and at times of their own, so the force is taken at the time stamp of each position, on a straight
line between the control periods on either side, and the work between two positions by the trapezoid rule.
"""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array

LAG = 0.005


class PortEnergy:
    """N lanes; ``update`` is called once per control period of ``period`` s."""

    def __init__(self, period: float, lanes: int) -> None:
        self._stamp = np.full(lanes, -np.inf)
        self._forces = np.zeros((2, 2, lanes))
        self._offset, self._target = (np.zeros((2, lanes)) for _ in range(2))

    def reset(self, lanes: Mask) -> None:
        """Forget the past of the lanes of a mask (N,)."""
        self._stamp[lanes] = -np.inf

    def update(self, measurement: Measurement, reference: Reference, force: Array) -> tuple[Array, Array, Array, Array]:
        """Work, J, (N,), that the hand has done since the last call, that which it would have done had it moved as the target,
        and x - xt, m, (2, N), at the newest position."""
        starts = np.isneginf(self._stamp)
        late = measurement.time - measurement.position_time
        target = reference.position - late * reference.velocity
        new = measurement.position_time > self._stamp
        since = measurement.position_time - self._stamp
        offset = self._offset - np.expm1(-since / LAG) * (measurement.position - target - self._offset)
        late_force = self._forces[1] - np.expm1(-since / (2.0 * LAG)) * (force - self._forces[1])
        forces = np.stack([force, np.where(starts, force, late_force)])
        offset = np.where(starts, measurement.position - target, offset)
        mean = 0.5 * (forces + self._forces) * (new & ~starts)
        work = (mean * (offset - self._offset)).sum(axis=1)
        moved = target - self._target
        asked = (mean * moved).sum(axis=1)
        path = np.sqrt((mean**2).sum(axis=1) * (moved**2).sum(axis=0))
        self._stamp = np.where(new, measurement.position_time, self._stamp)
        self._forces = np.where(new, forces, self._forces)
        self._offset, self._target = np.where(new, offset, self._offset), np.where(new, target, self._target)
        return work, asked, path, self._offset
