"""A port followed over time: motion, force and energy at every period."""

from dataclasses import dataclass

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from lab.studies.stability.rig_port import Hand, Port


@dataclass(frozen=True)
class Recording:
    """``time`` (T,), s; ``position`` (T, 2, N), m, ``velocity`` (T, 2, N), m/s, and ``force`` of the hand (T, 2, N), N, then;
    ``energy`` (T, N), J, that the port had given to the hand by then."""

    time: Array
    position: Array
    velocity: Array
    force: Array
    energy: Array

    def part(self, begin: float, end: float) -> "Recording":
        """What lies between two times, s, the last one excluded."""
        # Half a period of tolerance: times are products with a period that is no binary number.
        slack = 0.5 * float(self.time[1] - self.time[0])
        kept = (self.time > begin - slack) & (self.time < end - slack)
        return Recording(*(rows[kept] for rows in (self.time, self.position, self.velocity, self.force, self.energy)))


def record(port: Port, hand: Hand, seconds: float) -> Recording:
    """Follow a port from its start for some seconds."""
    count = round(seconds / port.period)
    motion, force, energy = np.empty((count, 4, port.lanes)), np.empty((count, 2, port.lanes)), np.empty((count, port.lanes))
    for k in range(count):
        motion[k], energy[k] = port.motion(), port.energy
        port.advance(hand)
        force[k] = port.force
    return Recording(np.arange(count, dtype=np.float64) * port.period, motion[:, :2], motion[:, 2:], force, energy)
