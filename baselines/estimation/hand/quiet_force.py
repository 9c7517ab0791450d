"""A force that is found, not measured, as a law uses it: noise moves nothing.

The force used stays where it is while it is within a circle about the force found, but for a slow drift to the middle; else the
rim drags it along. An oscillation of the force found enlarges the circle: a stiff hand that holds the head and a law that gives
way to it late would swing for ever.
"""

import math

from baselines.estimation.hand.half_wave import HalfWave, sustained
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, part, row, rows

RADIUS, DRIFT = 2.0, 1.0
"""N and 1/s, of the circle and of the drift to its middle; found by trial. At rest the force found has a noise of 0.3 N."""

SLOW = 10.0
"""1/s; assumed: slower changes of the force are no oscillation."""

LEAST_SWING, MOST_SWING, GROWTH, FORGETTING = 1.5, 12.0, 1.5, 1.0
"""N, N, 1 and s: of a sustained oscillation between the first two the circle's radius grows by so many times its size, and
forgets it with this time constant. Found by trial; a pull that is let go swings the estimate by more."""


class Quiet(Rows):
    """What is remembered of the force found."""

    slow = rows("slow_x slow_y", "N", "low-passed")
    wave_x = part(HalfWave, "oscillation along x")
    wave_y = part(HalfWave, "oscillation along y")
    swing = row("N", "size of the last oscillation")


@helper
def quieten(quiet: Quiet, found: Array, period: float, fresh: Array, force: Array) -> None:
    """Carries ``force`` (2, N), N, on by one period to whose end a force (2, N), N, was ``found``."""
    kept = exact.exp(-period / FORGETTING)
    for i in range(fresh.shape[0]):
        x, y = found[0, i], found[1, i]
        if fresh[i] > 0.0:
            force[0, i], force[1, i], quiet.slow[0, i], quiet.slow[1, i] = x, y, x, y
        quiet.slow[0, i] += period * SLOW * (x - quiet.slow[0, i])
        quiet.slow[1, i] += period * SLOW * (y - quiet.slow[1, i])
        swung_x = sustained(quiet.wave_x, i, x - quiet.slow[0, i], period, LEAST_SWING, 0.0)
        swung_y = sustained(quiet.wave_y, i, y - quiet.slow[1, i], period, LEAST_SWING, 0.0)
        quiet.swing[i] = max(kept * quiet.swing[i], min(max(swung_x, swung_y), MOST_SWING))
        ex, ey = x - force[0, i], y - force[1, i]
        radius = RADIUS + GROWTH * quiet.swing[i]
        share = max(period * DRIFT, 1.0 - radius / max(math.sqrt(ex * ex + ey * ey), 1e-9))
        force[0, i] += share * ex
        force[1, i] += share * ey
