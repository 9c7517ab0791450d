"""Positions that are held one after the other, on a line; every move between two is a minimum-jerk step."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from birthsim_env.loop.rows import Seen
from birthsim_env.loop.stage import Stage, numbers, table2
from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.references import FARTHEST, LONGEST, SHORTEST, Planned, minimum_jerk, require_line
from birthsim_env.parts.times import Timed
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, number, rows
from birthsim_env.physics.rig.values import checked_number, checked_range, shown


class Moves(Numbers):
    """When and along what line."""

    middle = rows("x y", "m", "from which places count")
    direction = rows("x y", "1", "of the line")
    lasts = number("s", "how long a move takes")
    starts = rows(0, "s", "of the moves")


@kernel
def _steps(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Constants: ``Moves``; table (P, N): places along the line, m."""
    every, time, target = table2(tables, 0), seen.time, seen.reference
    moves, places = Moves(numbers(constants, Moves.size + every.shape[0])), every[:, lane : lane + n]
    starts, lasts = moves.starts, moves.lasts
    for i in range(n):
        k = 0
        while k + 1 < starts.shape[0] and time[i] >= starts[k + 1]:
            k += 1
        earlier = max(k - 1, 0)
        before = places[earlier, i] if k > 0 else 0.0
        way, u = places[k, i] - before, (time[i] - starts[k]) / lasts
        place, speed = before + way * minimum_jerk(u, 0), way * minimum_jerk(u, 1) / lasts
        bend, jerk = way * minimum_jerk(u, 2) / lasts**2, way * minimum_jerk(u, 3) / lasts**3
        for axis in range(2):
            along = moves.direction[axis]
            target.position[axis, i] = moves.middle[axis] + along * place
            target.velocity[axis, i], target.acceleration[axis, i] = along * speed, along * bend
            target.jerk[axis, i] = along * jerk
    return 0


class PositionSteps(Planned):
    """From ``middle`` to one place on a line after the other, at rest between moves.

    Parameters
    ----------
    middle : (float, float)
        x and y, m, where it starts, and from which places count.
    heading : float
        Of the line, rad from x.
    starts : sequence of float
        s at which the moves start, one after the other has ended.
    places : sequence of float
        Where each move ends, m along the line; each may be a range (low, high), from which every episode draws.
    lasts : float
        s that a move takes, at minimum jerk.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    """

    def __init__(
        self,
        middle: tuple[float, float] = (0.5, 0.0),
        heading: float = 0.0,
        starts: Sequence[float] = (1.0,),
        places: Sequence[Range] = (0.05,),
        lasts: float = 1.0,
    ) -> None:
        require_line(middle, heading)
        checked_number("lasts", lasts, "s", least=SHORTEST, most=LONGEST)
        for name, column in (("starts", starts), ("places", places)):
            if not (isinstance(column, (tuple, list)) and len(column) > 0):
                raise ValueError(f"{name} = {shown(column)}; allowed: a tuple with an entry per move")
        for instant in starts:
            checked_number("starts", instant, "s", least=0.0, most=LONGEST)
        for place in places:
            checked_range("places", place, "m", least=-FARTHEST, most=FARTHEST)
        if len(places) != len(starts):
            raise ValueError(f"places = {shown(places)}; allowed: as many as starts, {len(starts)}")
        if not all(later - sooner >= lasts for sooner, later in pairwise(starts)):
            raise ValueError(f"starts = {shown(starts)}; allowed: increasing, by lasts = {lasts!r} s or more")
        self.middle, self.heading, self.starts, self.places, self.lasts = middle, heading, starts, places, lasts
        self.timed = Timed(np.empty(0), float(starts[0]))

    def prepare(self, num_envs: int) -> None:
        self._own = np.zeros((len(self.places), num_envs))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        put(self._own, lane, [draw(place, rng) for place in self.places])

    def stage(self) -> Stage:
        starts: Array = np.array(self.starts, dtype=np.float64)
        direction = exact.direction(self.heading)
        constants = Moves.numbers(middle=self.middle, direction=direction, lasts=self.lasts, starts=starts)
        return Stage(_steps, constants, tables=(self._own,))
