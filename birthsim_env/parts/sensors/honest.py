"""The sensor model ``honest``: all errors that data sheets and laboratories know.

The board converts what it commands the valves, and misses periods there too.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import OPENING, TICK, Seen, World
from birthsim_env.loop.stage import Stage, table1, table2
from birthsim_env.parts.sensors.board import BoardSensors
from birthsim_env.parts.sensors.noise import happens, uniform
from birthsim_env.parts.sensors.readings import MISSED, converted
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS, Errors, Shared, shift
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.electronics import Electronics
from birthsim_env.registry import register

LATE = 10
"""Channel of random numbers of the clock; ``board`` and ``readings`` have the others."""


@kernel
def _put_out(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Make the openings what the board puts out, which is ``last`` (4, N) in a missed period.

    A clock that jitters is late by a fraction of the period, drawn uniformly. What is put out is then the mean of both openings
    over the period: the spool, with a lag of ``tau``, misses what it would do by at most (T/tau)^2/8 of the change.
    """
    mine = slice(lane, lane + n)
    keys, e, last = table1(tables, 0).view(np.uint64)[mine], Errors(table2(tables, 1)[:, mine]), table2(tables, 2)[:, mine]
    for i in range(n):
        tick, jitter = int(world.tick[i]), e.parameters.clock_jitter[i]
        missed = tick > 0 and happens(keys[i], tick, MISSED, e.parameters.missed_periods[i])
        late = jitter * uniform(keys[i], np.uint64(tick * 32 + 2 * LATE)) if tick > 0 and jitter > 0.0 else 0.0
        for valve in range(4):
            value = converted(seen.opening[valve, i], e.opening_step[i], -1.0, 1.0)
            value = last[valve, i] if missed else value
            seen.opening[valve, i] = value + late * (last[valve, i] - value)
            last[valve, i] = value
    return 0


class HonestBoard(BoardSensors):
    """``BoardSensors`` with all of their errors, whose figures episodes may draw. The valves are commanded through a converter,
    and stay as they were in a missed period (``board_stage``)."""

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        super().__init__(electronics, num_envs)
        self._last: Array = np.zeros((4, num_envs))

    def vary(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        self._ranges = {name.removeprefix("electronics."): ranges[name] for name in sorted(ranges)}
        self._make_room()

    @property
    def parameters(self) -> dict[str, Array]:
        """Parameter -> what the episode of each lane has, (N,)."""
        return dict(zip(SENSOR_PARAMETERS, Errors(self._errors).parameters.rows, strict=True))

    @property
    def errors(self) -> Array:
        """``sensor_errors.Errors`` that the episode of each lane has, (M, N)."""
        return self._errors

    def put_out(self, ticks: NDArray[np.int64], openings: Array) -> Array:
        out, tick = np.array(openings, dtype=np.float64, order="C"), np.array(ticks[None], dtype=np.float64)
        Loop(len(ticks), [(tick, TICK)], [(out, OPENING)], [self.board_stage()]).run()
        return out

    def board_stage(self) -> Stage:
        return Stage(_put_out, tables=(self._keys.view(np.float64), self._errors, self._last))


@register(sensors="honest", about="Tracker, cells and force sensor with every error that data sheets name.", order=3)
class HonestSensors(HonestBoard):
    """A tracker, pressure cells and a force sensor at the head, on such a board."""

    drawn = tuple(f"electronics.{name}" for name in SENSOR_PARAMETERS)

    def shift(self, place: Array) -> Array:
        """By how much scale and distortion move what the tracker shows of true places, both (2, N), m."""
        return shift(Errors(self._errors), Shared(self._shared), place)
