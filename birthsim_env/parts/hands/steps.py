"""The hand ``steps``, which is that of Fig. 4."""

from typing import Self

import numpy as np

from birthsim_env.parts.drawn.seeding import Range, draw, vectorised
from birthsim_env.parts.hands.user_forces import MOST, STRONGEST, ForceProfile
from birthsim_env.parts.references import LONGEST
from birthsim_env.physics.rig.values import checked_count, checked_number, checked_range
from birthsim_env.registry import register


@register(hand="steps", about="Pushes along +x, -x, +y and -y, one after the other.", order=1)
class AlternatingSteps(ForceProfile):
    """The pushes of Fig. 4, repeated every ``repeat`` s: +x, -x, +y, -y of ``amplitude`` N, ``ramp`` s up and down."""

    STARTS = ((1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (6.9, 7.7))
    """Assumed: start and end of the four pushes, s; every push ends well before the next."""

    directions = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))

    jump_rate = 1.0
    """N/s: every ramp is a step, however small the push."""

    def __init__(self, amplitude: Range = 30.0, ramp: float = 0.1, repeat: float = 8.0, repeats: int = 2) -> None:
        super().__init__()
        checked_range("amplitude", amplitude, "N", least=-STRONGEST, most=STRONGEST)
        checked_number("ramp", ramp, "s", least=0.0, most=0.3)
        checked_number("repeat", repeat, "s", least=8.0, most=LONGEST)
        repeats = checked_count("repeats", repeats, 0, MOST)
        self.amplitude, self.ramp, self.repeat, self.repeats = amplitude, ramp, repeat, repeats

    @classmethod
    def varied(cls) -> Self:
        return cls(amplitude=(10.0, 40.0), repeats=3)

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        knots = [(0.0, 0.0, 0.0)]
        for k in range(self.repeats):
            for (start, end), (dx, dy) in zip(self.STARTS, self.directions, strict=True):
                size = draw(self.amplitude, rng)
                begin, stop = k * self.repeat + start, k * self.repeat + end
                knots += [(begin, 0.0, 0.0), (begin + self.ramp, size * dx, size * dy)]
                knots += [(stop, size * dx, size * dy), (stop + self.ramp, 0.0, 0.0)]
        return knots
