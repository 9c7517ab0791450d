"""A sequential test on innovations, which tells a filter that what it follows has begun to move (Page 1954).

With an innovation n in its standard deviations, per piston
    g+ = max(0, g+ + n - k),   g- = max(0, g- - n - k)
Noise keeps both near zero; a lasting innovation of more than k adds up. Beyond a level both start anew and the filter is made
quick: the density of what drives its force is larger by ``BOOST``, which fades. The alarm tells the filter alone. Whether a
rest has ended is judged by the force that the quick filter finds.
"""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.records import Rows, rows

DRIFT, LEVEL = 0.25, 12.0
"""k and the level, in standard deviations; found by trial. With a level of 8 noise makes a resting head hunt by 0.6 mm in the
median, with 16 slow pushes along y are found up to 0.75 instead of 0.9 Hz."""

BOOST, FADES = 100.0, 0.3
"""Factor of the density after an alarm, and s in which it fades; found by trial."""


class CumulativeSums(Rows):
    """The test of both pistons."""

    up = rows("up1 up2", "1", "g+")
    down = rows("down1 down2", "1", "g-")
    boost = rows("boost1 boost2", "1", "by how much the force is noisier")


@helper
def begin(sums: CumulativeSums, k: int, i: int) -> None:
    """Starts piston ``k`` of lane ``i``."""
    sums.up[k, i], sums.down[k, i], sums.boost[k, i] = 0.0, 0.0, 0.0


@helper
def take(sums: CumulativeSums, k: int, i: int, innovation: float) -> None:
    """Takes an ``innovation`` of piston ``k`` of lane ``i``, in its standard deviations."""
    up, down = max(0.0, sums.up[k, i] + innovation - DRIFT), max(0.0, sums.down[k, i] - innovation - DRIFT)
    alarm = max(up, down) > LEVEL
    sums.up[k, i], sums.down[k, i] = 0.0 if alarm else up, 0.0 if alarm else down
    sums.boost[k, i] = BOOST if alarm else sums.boost[k, i]


@helper
def fade(sums: CumulativeSums, k: int, i: int, period: float) -> None:
    """Lets what alarms have left of piston ``k`` of lane ``i`` fade by a period."""
    sums.boost[k, i] -= sums.boost[k, i] * min(1.0, period / FADES)
