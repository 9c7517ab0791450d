"""A force that is found, not measured, at rest: what a resting piston tells of it is noise.

The force is followed while it moves, and held at rest:

- it is at rest once ``quick`` has stayed within ``STIRS`` of ``slow``, which are the force low-passed, for ``SETTLES``;
- at rest the force is averaged over the time since then, at most over 1/``DRIFT``;
- a rest ends where ``quick`` is off by more than ``QUICK_LIMIT`` or ``slow`` by more than ``SLOW_LIMIT``.
"""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows

QUICK, SLOW = 10.0, 3.0
"""1/s, of the low-passes on which a rest is judged; the first found by trial, the second assumed."""

STIRS, QUICK_LIMIT, SLOW_LIMIT = 2.5, 5.0, 1.3
"""N; found by trial. Larger limits miss small pushes, smaller ones let noise end a rest."""

SETTLES = 0.9
"""s that the force must stay as it is before the head counts as resting; found by trial."""

FIRST, AVERAGED, DRIFT = 0.1, 1.0, 0.2
"""s, s and 1/s: the force at rest is a mean that begins with the weight of ``FIRST``, for ``AVERAGED``, and then a low-pass."""


class RestDetector(Rows):
    """What tells a head that rests."""

    quick = rows("quick_x quick_y", "N", "force, low-passed with ``QUICK``")
    slow = rows("slow_x slow_y", "N", "force, low-passed with ``SLOW``")
    still = row("s", "since the force moved, until the head counts as resting")
    rested = row("s", "since the head rests; 0 while it does not")


@helper
def hold(detector: RestDetector, bare: Array, period: float, fresh: Array, force: Array) -> None:
    """Writes ``force`` (2, N), N: the ``bare`` one (2, N), or at rest its mean."""
    for i in range(fresh.shape[0]):
        _hold(detector, force, bare, i, period, fresh[i] > 0.0)


@helper
def _hold(detector: RestDetector, force: Array, bare: Array, i: int, period: float, new: bool) -> None:
    """``hold`` of lane ``i``."""
    if new:
        detector.still[i], detector.rested[i] = 0.0, 0.0
    stirred, quick_off, slow_off = 0.0, 0.0, 0.0
    for axis in range(2):
        now = bare[axis, i]
        quick = now if new else detector.quick[axis, i] + period * QUICK * (now - detector.quick[axis, i])
        slow = now if new else detector.slow[axis, i] + period * SLOW * (quick - detector.slow[axis, i])
        detector.quick[axis, i], detector.slow[axis, i] = quick, slow
        held = force[axis, i]
        stirred, quick_off, slow_off = (
            stirred + (quick - slow) ** 2,
            quick_off + (quick - held) ** 2,
            slow_off + (slow - held) ** 2,
        )
    resting = detector.rested[i] > 0.0
    if resting and (quick_off > QUICK_LIMIT * QUICK_LIMIT or slow_off > SLOW_LIMIT * SLOW_LIMIT):
        detector.still[i], detector.rested[i] = 0.0, 0.0
    elif not resting:
        detector.still[i] = 0.0 if stirred > STIRS * STIRS else detector.still[i] + period
    rested = detector.rested[i] + period if detector.still[i] > SETTLES else 0.0
    detector.rested[i] = rested
    share = 1.0 if rested == 0.0 else period / (FIRST + rested) if rested < AVERAGED else period * DRIFT
    for axis in range(2):
        force[axis, i] = bare[axis, i] if new else force[axis, i] + share * (bare[axis, i] - force[axis, i])
