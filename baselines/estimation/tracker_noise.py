"""Noise of a tracker, identified from its own samples.

Three samples at times t1 < t2 < t3 of a motion without acceleration are on one line: with q = (t3 - t2)/(t2 - t1),
    e = x3 - x2 - q (x2 - x1)   has the variance   s^2 (1 + (1 + q)^2 + q^2).
So the samples tell s without a model of the rig, wherever the noise comes from. An acceleration of 2 m/s2 at 240 Hz is an e of
35 um; larger ones are clipped.
"""

from __future__ import annotations

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

ROWS = 8
"""x, y and time of the last two samples, the variance of a sample, m2, and the number of samples so far."""
BEFORE, LAST, VARIANCE, COUNT = 0, 3, 6, 7

SAMPLES = 100.0
"""assumed: samples over which the variance is averaged, 0.4 s at 240 Hz."""

FIRST = 10.0
"""assumed: so many samples what is believed counts for at first."""

CLIP = 9.0
"""assumed: no e^2 counts for more than so many times its expectation; of normal noise 0.3 % are clipped."""


@helper
def observe(memory: Array, position: Array, position_time: Array, believed: float, fresh: Array) -> None:
    """Carries ``memory`` (ROWS, N) on by one period. ``believed``, m, is the standard deviation at a new start."""
    for i in range(position_time.shape[0]):
        x, y, t = position[0, i], position[1, i], position_time[i]
        if fresh[i] > 0.0:
            for k in range(0, VARIANCE, 3):
                memory[k, i], memory[k + 1, i], memory[k + 2, i] = x, y, t
            memory[VARIANCE, i], memory[COUNT, i] = believed * believed, 0.0
        first, second = memory[LAST + 2, i] - memory[BEFORE + 2, i], t - memory[LAST + 2, i]
        if second <= 0.0:
            continue
        if first > 0.0:
            q = second / first
            ex = x - memory[LAST, i] - q * (memory[LAST, i] - memory[BEFORE, i])
            ey = y - memory[LAST + 1, i] - q * (memory[LAST + 1, i] - memory[BEFORE + 1, i])
            scale = 1.0 / (1.0 + (1.0 + q) * (1.0 + q) + q * q)
            variance = memory[VARIANCE, i]
            told = 0.5 * (min(ex * ex * scale, CLIP * variance) + min(ey * ey * scale, CLIP * variance))
            memory[COUNT, i] = min(memory[COUNT, i] + 1.0, SAMPLES - FIRST)
            memory[VARIANCE, i] = variance + (told - variance) / (FIRST + memory[COUNT, i])
        for k in range(3):
            memory[BEFORE + k, i] = memory[LAST + k, i]
        memory[LAST, i], memory[LAST + 1, i], memory[LAST + 2, i] = x, y, t
