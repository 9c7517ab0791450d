"""Half waves of an error that swings about zero."""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.records import Rows, row

HALF_WAVE = 0.2
"""s: a longer half wave is no oscillation of a loop."""

SUSTAINED = 0.75
"""A half wave of at least this fraction of the one before is sustained; a transient dies faster."""


class HalfWave(Rows):
    """The half wave of an error, here a speed, that is under way, and the one before."""

    extreme = row("m/s", "largest error of this half wave")
    since = row("s", "since it began")
    peak = row("m/s", "largest error of the last one")


@helper
def sustained(wave: HalfWave, i: int, error: float, period: float, level: float, before: float) -> float:
    """Size of a sustained half wave of a speed error beyond ``level`` that has just ended, else zero.

    One is sustained where the half wave before it went beyond ``before``.
    """
    extreme = wave.extreme[i]
    wave.since[i] += period
    if error * extreme < 0.0:
        peak = abs(extreme) if wave.since[i] < HALF_WAVE else 0.0
        last = wave.peak[i]
        wave.extreme[i], wave.since[i], wave.peak[i] = error, 0.0, peak
        return peak if peak > level and last > before and peak > SUSTAINED * last else 0.0
    if abs(error) > abs(extreme):
        wave.extreme[i] = error
    return 0.0
