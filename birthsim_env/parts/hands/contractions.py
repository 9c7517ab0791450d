"""The force of uterine contractions with maternal pushes."""

import math
from typing import ClassVar

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage, table1, table2, table3
from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised, whole
from birthsim_env.parts.hands.user_forces import MOST, STRONGEST, UserForce, knot_before
from birthsim_env.parts.references import TURNED
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, row, rows
from birthsim_env.physics.rig.values import checked_count, checked_number, checked_range, shown
from birthsim_env.restored import Declared, Kept


class Contraction(Rows):
    """What an episode draws for each of its contractions."""

    amplitude = row("N", "of the contraction")
    push = row("1", "of its pushes, in amplitudes")
    wave = row("1", "row of the pushes among the waves")


class Heading(Numbers):
    """Where the force points."""

    along = rows("x y", "1", "cosine and sine")


SWELL = 0
"""Row of the contraction itself among the waves."""


@helper
def _size(own: Array, waves: Array, knot: int, i: int) -> float:
    """Force at a knot, N: less of the contraction, so that the sum with its pushes peaks near its amplitude."""
    k, place = knot // waves.shape[1], knot % waves.shape[1]
    if k == own.shape[0]:
        return 0.0
    one = Contraction(own[k])
    swell, wave, part = waves[SWELL, place], waves[int(one.wave[i]), place], one.push[i]
    size: float = one.amplitude[i] * ((1.0 - part) * swell * swell + part * wave * wave)
    return size


@helper
def _contract(time: Array, own: Array, waves: Array, times: Array, heading: Heading, force: Array, n: int) -> None:
    """``own`` (K, 3, N), each a ``Contraction``; ``waves`` (W, M) of the contraction and of its pushes, 0 to 1, at the M knots
    of each; ``times`` (K M + 1,) of all knots, between which the force is linear."""
    for i in range(n):
        low = knot_before(times[:, None], 0, times.shape[0], time[i])
        high = low + 1
        span = times[high] - times[low]
        part = max(0.0, min(1.0, (time[i] - times[low]) / span)) if span > 0.0 else 1.0
        before, after = _size(own, waves, low, i), _size(own, waves, high, i)
        for axis in range(2):
            first = before * heading.along[axis]
            force[axis, i] = first + part * (after * heading.along[axis] - first)


@kernel
def _contractions_stage(world: World, seen: Seen, memory: int, heading: Heading, tables: int, lane: int, n: int) -> int:
    own = table3(tables, 0)[:, :, lane : lane + n]
    _contract(seen.time, own, table2(tables, 1), table1(tables, 2), heading, world.force, n)
    return 0


class Contractions(UserForce):
    """Uterine contractions: sin^2 of ``lasts`` s and ``amplitude`` N, with maternal pushes on top, along ``heading``.

    Each contraction carries ``pushes`` sin^2 bumps of ``push`` times its amplitude over its middle half (assumed).
    """

    in_state: ClassVar[Declared] = {"_own": Kept(0, "_waves", whole=True, index=True, at=(slice(None), Contraction.wave.first))}

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
        checked_range("amplitude", amplitude, "N", least=-STRONGEST, most=STRONGEST)
        self.count = checked_count("count", count, 1, MOST)
        checked_number("lasts", lasts, "s", least=2 * self.GRID, most=3600.0)
        if not (isinstance(pushes, tuple) and len(pushes) == 2):
            raise ValueError(f"pushes = {shown(pushes)}; allowed: the least and the most pushes of a contraction")
        least = checked_count("pushes, the least", pushes[0], 0, MOST)
        self.pushes = least, checked_count("pushes, the most", pushes[1], least, MOST)
        checked_range("push", push, "1", least=0.0, most=1.0)
        checked_number("heading", heading, "rad", least=-TURNED, most=TURNED)
        self.amplitude, self.lasts, self.push, self.heading = amplitude, lasts, push, heading

    def prepare(self, num_envs: int) -> None:
        time, most = np.arange(0.0, self.lasts, self.GRID), self.pushes[1]
        middle = np.clip((time - 0.25 * self.lasts) / (0.5 * self.lasts), 0.0, 1.0)
        turns = [math.pi * time / self.lasts, *(math.pi * bumps * middle for bumps in range(most + 1))]
        self._waves: Array = np.array([exact.direction(one)[1] for one in turns])
        begins = self.lasts * np.arange(self.count)
        self._times: Array = np.concatenate([*(one + time for one in begins), [self.count * self.lasts]])
        self._heading = Heading.numbers(along=exact.direction(self.heading))
        self._own: Array = np.zeros((self.count, Contraction.size, num_envs))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        least, most = self.pushes
        for own in self._own:
            amplitude, push = draw(self.amplitude, rng), draw(self.push, rng)
            put(own, lane, (amplitude, push, whole(1 + least, 2 + most, rng)))

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        forces, heading = np.empty((time.shape[0], 2, time.shape[1])), Heading(self._heading)
        for now, force in zip(time, forces, strict=True):
            _contract(now, self._own, self._waves, self._times, heading, force, len(now))
        return forces

    def stage(self) -> Stage:
        """``force``, compiled into the closed loop."""
        return Stage(_contractions_stage, self._heading, tables=(self._own, self._waves, self._times))
