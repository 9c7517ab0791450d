"""The force of uterine contractions with maternal pushes."""

import math

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.drawn.seeding import Range, draw, vectorised
from birthsim_env.parts.hands.user_forces import MOST, STRONGEST, ForceProfile
from birthsim_env.parts.references import TURNED
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import checked_count, checked_number, checked_range, shown


class Contractions(ForceProfile):
    """Uterine contractions: sin^2 of ``lasts`` s and ``amplitude`` N, with maternal pushes on top, along ``heading``.

    Each contraction carries ``pushes`` sin^2 bumps of ``push`` times its amplitude over its middle half (assumed).
    """

    GRID = 0.05
    """s between knots: below 0.2 % of the amplitude in error."""

    def __init__(
        self,
        amplitude: Range = 80.0,
        count: int = 2,
        lasts: float = 12.0,
        pushes: tuple[int, int] = (4, 5),
        push: Range = 0.25,
        heading: float = 0.0,
    ) -> None:
        super().__init__()
        self.amplitude, self.count, self.lasts, self.pushes, self.push = amplitude, count, lasts, pushes, push
        self.heading = heading
        checked_range("amplitude", amplitude, "N", least=-STRONGEST, most=STRONGEST)
        checked_count("count", count, 1, MOST)
        checked_number("lasts", lasts, "s", least=2 * self.GRID, most=3600.0)
        if not (isinstance(pushes, tuple) and len(pushes) == 2):
            raise ValueError(f"pushes = {shown(pushes)}; allowed: the least and the most pushes of a contraction")
        checked_count("pushes, the most", pushes[1], checked_count("pushes, the least", pushes[0], 0, MOST), MOST)
        checked_range("push", push, "1", least=0.0, most=1.0)
        checked_number("heading", heading, "rad", least=-TURNED, most=TURNED)

    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        table = self._table(1)
        self._contract(table, np.zeros(1, dtype=np.int64), rng)
        return [tuple(knot) for knot in table[:, :, 0].tolist()]

    def prepare(self, num_envs: int) -> None:
        self._knots = self._table(num_envs)
        self._counts = np.full(num_envs, float(len(self._knots)))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        if type(self).knots is Contractions.knots:
            self._contract(self._knots, np.atleast_1d(lane), rng)
        else:
            super().begin(lane, rng)

    @property
    def _time(self) -> Array:
        """Since a contraction began, s, (M,)."""
        return np.arange(0.0, self.lasts, self.GRID)

    def _table(self, lanes: int) -> Array:
        """Knots (M, 3, N) without forces; their times are the same in all lanes and episodes."""
        times = [begins + self._time for begins in self.lasts * np.arange(self.count)]
        table = np.zeros((self.count * len(self._time) + 1, 3, lanes))
        table[:, 0] = np.concatenate([*times, [self.count * self.lasts]])[:, None]
        return table

    def _contract(self, table: Array, lanes: NDArray[np.int64], rng: np.random.Generator) -> None:
        """Draw the forces of the lanes (L,) of a table of knots."""
        time, (x, y), (least, most) = self._time, exact.direction(self.heading), self.pushes
        _, swell = exact.direction(math.pi * time / self.lasts)
        middle = np.clip((time - 0.25 * self.lasts) / (0.5 * self.lasts), 0.0, 1.0)
        waves = np.array([exact.direction(math.pi * bumps * middle)[1] for bumps in range(least, most + 1)])
        for contraction in table[:-1].reshape(self.count, len(time), 3, table.shape[2]):
            size, fraction = draw(self.amplitude, rng), draw(self.push, rng)
            bumps = np.broadcast_to(rng.integers(least, most + 1), lanes.shape, subok=True)
            push = np.select([bumps == count for count in range(least, most + 1)], list(waves[:, :, None]))
            # Less of the contraction, so that the sum with its pushes peaks near its size.
            force = size * ((1.0 - fraction) * swell[:, None] * swell[:, None] + fraction * push * push)
            contraction[:, 1, lanes], contraction[:, 2, lanes] = force * x, force * y
