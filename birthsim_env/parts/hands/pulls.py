"""Tractions one after the other."""

from typing import Any

import numpy as np

from birthsim_env.parts.drawn.seeding import Range, draw, vectorised
from birthsim_env.parts.hands.user_forces import MOST, STRONGEST, ForceProfile
from birthsim_env.parts.references import LONGEST, TURNED
from birthsim_env.parts.times import Timed
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.rig.values import checked_number, checked_range, shown


class Pulls(ForceProfile):
    """Tractions one after the other: ramp at ``rate`` N/s, hold, release, pause.

    ``sizes`` N, one per pull; ``angle`` rad from x; ``hold``, ``release``, ``pause`` and ``begins`` in s.
    """

    def __init__(
        self,
        sizes: tuple[Range, ...],
        rate: Range,
        angle: Range = 0.0,
        begins: float = 1.0,
        hold: float = 2.0,
        release: float = 0.3,
        pause: float = 1.2,
    ) -> None:
        super().__init__()
        if not isinstance(sizes, (tuple, list)) or len(sizes) > MOST:
            raise ValueError(f"sizes = {shown(sizes)}; allowed: a tuple of at most {MOST} pulls (N)")
        for size in sizes:
            checked_range("sizes", size, "N", least=0.0, most=STRONGEST)
        checked_range("rate", rate, "N/s", least=1.0, most=1e6)
        checked_range("angle", angle, "rad", least=-TURNED, most=TURNED)
        for name, value in (("begins", begins), ("hold", hold), ("release", release), ("pause", pause)):
            checked_number(name, value, "s", least=0.0, most=LONGEST)
        self.sizes, self.rate, self.angle = sizes, rate, angle
        self.begins, self.hold, self.release, self.pause = begins, hold, release, pause
        self.timed = Timed(np.empty(0), begins)

    def peak(self, size: Range, rng: np.random.Generator) -> Any:
        """Force of a pull, N, from its entry in ``sizes``."""
        return draw(size, rng)

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        knots = [(0.0, 0.0, 0.0)]
        now = self.begins
        for sizes in self.sizes:
            size, rate = self.peak(sizes, rng), draw(self.rate, rng)
            along, across = exact.direction(draw(self.angle, rng))
            x, y, top = size * along, size * across, now + size / rate
            knots += [(now, 0.0, 0.0), (top, x, y), (top + self.hold, x, y), (top + self.hold + self.release, 0.0, 0.0)]
            now = top + self.hold + self.release + self.pause
        return knots
