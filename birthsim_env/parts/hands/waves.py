"""Hands that are sums of sines."""

import math

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage, table4
from birthsim_env.parts.hands.user_forces import CompiledForce
from birthsim_env.parts.references import minimum_jerk
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row

FADE = 0.5
"""s over which a sine and noise begin, at minimum jerk."""

FASTEST = 100.0
"""Hz: hands move at a few, and a control period is a ms."""


class Wave(Rows):
    """A sine."""

    amplitude = row("N", "amplitude")
    rate = row("rad/s", "angular frequency")
    phase = row("rad", "at the beginning")


@kernel
def _waves(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Table (2, W, 3, N): of each axis the waves, each a ``Wave``."""
    time, own, force = seen.time, table4(tables, 0)[:, :, :, lane : lane + n], world.force
    for i in range(n):
        fraction = minimum_jerk(time[i] / FADE, 0)
        for axis in range(2):
            total = 0.0
            for w in range(own.shape[1]):
                wave = Wave(own[axis, w])
                total += wave.amplitude[i] * exact.sine(wave.rate[i] * time[i] + wave.phase[i])
            force[axis, i] = fraction * total
    return 0


class Waves(CompiledForce):
    """Sums of sines."""

    jump_rate = math.inf
    waves = 1

    def prepare(self, num_envs: int) -> None:
        self._own: Array = np.zeros((2, self.waves, Wave.size, num_envs))

    def stage(self) -> Stage:
        return Stage(_waves, tables=(self._own,))
