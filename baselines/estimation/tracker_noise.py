"""Noise of a tracker, identified from its own samples.

Three samples at times t1 < t2 < t3 of a motion without acceleration are on one line: with q = (t3 - t2)/(t2 - t1),
    e = x3 - x2 - q (x2 - x1)   has the variance   s^2 (1 + (1 + q)^2 + q^2).
So the samples give s without a model of the rig, wherever the noise comes from. An acceleration of 2 m/s2 at 240 Hz is an e of
35 um; larger ones are clipped.
"""

from birthsim_env.loop.rows import Signals
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows

SAMPLES = 100.0
"""assumed: samples over which the variance is averaged, 0.4 s at 240 Hz."""

FIRST = 10.0
"""assumed: so many samples what is believed counts for at first."""

CLIP = 9.0
"""assumed: no e^2 counts for more than so many times its expectation; of normal noise 0.3 % are clipped."""


class Tracker(Rows):
    """The last two samples and what they say of the noise."""

    older = rows("older_x older_y", "m", "sample before the newest")
    older_time = row("s", "of that sample")
    newest = rows("newest_x newest_y", "m", "newest sample")
    newest_time = row("s", "of that sample")
    variance = row("m2", "variance of a sample")
    count = row("1", "samples so far")


@helper
def observe(tracker: Tracker, seen: Signals, believed: float, fresh: Array) -> None:
    """Carries ``tracker`` on by one period. ``believed``, m, is the standard deviation at a new start."""
    older, newest = tracker.older, tracker.newest
    for i in range(fresh.shape[0]):
        x, y, t = seen.position[0, i], seen.position[1, i], seen.position_time[i]
        if fresh[i] > 0.0:
            older[0, i], older[1, i], tracker.older_time[i] = x, y, t
            newest[0, i], newest[1, i], tracker.newest_time[i] = x, y, t
            tracker.variance[i], tracker.count[i] = believed * believed, 0.0
        first, second = tracker.newest_time[i] - tracker.older_time[i], t - tracker.newest_time[i]
        if second <= 0.0:
            continue
        if first > 0.0:
            q = second / first
            ex = x - newest[0, i] - q * (newest[0, i] - older[0, i])
            ey = y - newest[1, i] - q * (newest[1, i] - older[1, i])
            scale = 1.0 / (1.0 + (1.0 + q) * (1.0 + q) + q * q)
            variance = tracker.variance[i]
            found = 0.5 * (min(ex * ex * scale, CLIP * variance) + min(ey * ey * scale, CLIP * variance))
            tracker.count[i] = min(tracker.count[i] + 1.0, SAMPLES - FIRST)
            tracker.variance[i] = variance + (found - variance) / (FIRST + tracker.count[i])
        older[0, i], older[1, i], tracker.older_time[i] = newest[0, i], newest[1, i], tracker.newest_time[i]
        newest[0, i], newest[1, i], tracker.newest_time[i] = x, y, t
