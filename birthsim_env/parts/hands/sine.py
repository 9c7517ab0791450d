"""The hand ``sine``."""

import math
from typing import Self

import numpy as np

from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.hands.user_forces import STRONGEST
from birthsim_env.parts.hands.waves import FASTEST, Waves
from birthsim_env.parts.references import TURNED
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.rig.values import checked_range
from birthsim_env.registry import register


@register(hand="sine", about="A force along a line that rises and falls as a sine.", order=2)
class Sine(Waves):
    """``amplitude`` N at ``frequency`` Hz along ``angle`` (rad from x)."""

    def __init__(self, amplitude: Range = 20.0, frequency: Range = 1.0, angle: Range = 0.0) -> None:
        checked_range("amplitude", amplitude, "N", least=-STRONGEST, most=STRONGEST)
        checked_range("frequency", frequency, "Hz", least=0.0, most=FASTEST)
        checked_range("angle", angle, "rad", least=-TURNED, most=TURNED)
        self.amplitude, self.frequency, self.angle = amplitude, frequency, angle

    @classmethod
    def varied(cls) -> Self:
        return cls(amplitude=(10.0, 30.0), frequency=(0.3, 2.0), angle=(0.0, 2 * math.pi))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        size, rate, angle = draw(self.amplitude, rng), 2 * math.pi * draw(self.frequency, rng), draw(self.angle, rng)
        x, y = exact.direction(angle)
        put(self._own[:, 0, 0], lane, (size * x, size * y))
        put(self._own[:, 0, 1], lane, (rate, rate))
