"""What N lanes are like at one instant: plant, hand, what is measured and what is asked for."""

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop import rows as at
from birthsim_env.loop.rows import measurement_of
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters


class Instant:
    """``num_envs`` lanes now. ``impacts`` (2, N), m/s, are the fastest collisions with end stops in the last step."""

    def __init__(self, parameters: Parameters, num_envs: int) -> None:
        self.parameters, self.plant = parameters, Plant(parameters, num_envs)
        self._tick, self._since = np.zeros((1, num_envs)), np.zeros((1, num_envs))
        self._motion, self._force = np.zeros((4, num_envs)), np.zeros((2, num_envs))
        self._at_valves: Array = np.zeros((4, num_envs))
        self.impacts: Array = np.zeros((2, num_envs))
        self._openings: Array = np.zeros((4, num_envs))
        self._seen: Array = np.zeros((at.ASKED, num_envs))
        self._sampled = False

    @property
    def time(self) -> Array:
        """s since each lane's episode began, (N,)."""
        return np.array(self._seen[at.TIME])

    @property
    def ticks(self) -> NDArray[np.int64]:
        """Control periods since each lane's episode began, (N,)."""
        return np.array(self._tick[0], dtype=np.int64)

    @property
    def motion(self) -> Array:
        """True x, y (m), vx, vy (m/s) of the end effector, (4, N)."""
        return self._motion.copy()

    @property
    def force(self) -> Array:
        """User force now, N, (2, N)."""
        return self._force.copy()

    @property
    def since_jump(self) -> Array:
        """s since force or stiffness setpoint jumped, (N,)."""
        return np.array(self._since[0])

    @property
    def openings(self) -> Array:
        """Openings of the valves of chambers P1, N1, P2, N2 as last commanded, (4, N)."""
        return self._openings.copy()

    @property
    def seen(self) -> Array:
        """The first rows of ``Seen``: what the sensors say and what is asked for."""
        return self._seen

    @property
    def reference(self) -> Reference:
        """What is asked for now."""
        return self.signals_in(self._seen)[1]

    @property
    def measurement(self) -> Measurement:
        """What the sensors say now."""
        return self.signals_in(self._seen)[0]

    def signals_in(self, seen: Array) -> tuple[Measurement, Reference]:
        """What the sensors say and what is asked for in rows as those of ``seen``."""
        said = measurement_of(seen, self._sampled, self._sampled and self._has_acceleration)
        return said, Reference(seen[at.REFERENCE : at.ASKED].copy())

    @property
    def _has_acceleration(self) -> bool:
        """Whether the head has an acceleration sensor, which exact sensors do without."""
        return self.parameters.electronics.acceleration_bandwidth > 0.0
