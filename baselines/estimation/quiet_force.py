"""A force that is found, not measured, as a law uses it: what is noise moves nothing.

The force that is used trails the one that is found: it stays where it is while that is within a circle of radius r, but for a
slow drift to its middle, and is dragged along by the rim. An oscillation makes the circle as large as itself: a stiff hand that
holds the head, and a law that gives way to it with a delay, swing at 5 to 13 Hz until one of them stops.
"""

import math

from baselines.estimation.half_wave import HalfWave, sustained
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, part, row, rows

RADIUS, DRIFT = 2.0, 1.0
"""N and 1/s; found by trial."""

SLOW, LEVEL, FORGET = 10.0, 1.5, 1.0
"""1/s, N, s."""

GROWTH, LONGEST, MOST = 1.5, 0.3, 12.0


class Quiet(Rows):
    """What is remembered."""

    slow = rows("slow_x slow_y", "N", "force found, low-passed")
    wave_x = part(HalfWave, "along x")
    wave_y = part(HalfWave, "along y")
    swing = row("N", "size of the oscillation")


@helper
def quieten(quiet: Quiet, found: Array, period: float, fresh: Array, force: Array) -> None:
    """Carries ``force`` (2, N), N, on by one period to whose end a force (2, N), N, was ``found``."""
    kept = exact.exp(-period / FORGET)
    for i in range(fresh.shape[0]):
        x, y = found[0, i], found[1, i]
        if fresh[i] > 0.0:
            force[0, i], force[1, i], quiet.slow[0, i], quiet.slow[1, i] = x, y, x, y
        quiet.slow[0, i] += period * SLOW * (x - quiet.slow[0, i])
        quiet.slow[1, i] += period * SLOW * (y - quiet.slow[1, i])
        swung_x = sustained(quiet.wave_x, i, x - quiet.slow[0, i], period, LEVEL, 0.0, LONGEST)
        swung_y = sustained(quiet.wave_y, i, y - quiet.slow[1, i], period, LEVEL, 0.0, LONGEST)
        quiet.swing[i] = max(kept * quiet.swing[i], min(max(swung_x, swung_y), MOST))
        ex, ey = x - force[0, i], y - force[1, i]
        radius = RADIUS + GROWTH * quiet.swing[i]
        share = max(period * DRIFT, 1.0 - radius / max(math.sqrt(ex * ex + ey * ey), 1e-9))
        force[0, i] += share * ex
        force[1, i] += share * ey
