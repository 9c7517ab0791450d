"""Signals of the last control periods, at the time at which a late position was taken."""

import math

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

LONGEST_DELAY = 0.06
"""s: the oldest position whose force is still known; the longest latency that ``Electronics`` allows is 0.05 s."""


def slots_of(period: float) -> int:
    """How many control periods of ``period`` s are kept."""
    return math.ceil(LONGEST_DELAY / period) + 2


@helper
def recall(kept: Array, newest: Array, slots: int, late: float, signals: Array, then: Array, i: int) -> None:
    """Takes the ``signals`` (S, N) of now in lane ``i``, and writes those of ``late`` control periods ago into ``then`` (S, N).

    ``kept`` (``slots`` S, N) is a ring, whose ``newest`` (N,) period is the last; NaN before the first one, which then counts
    as all that were before."""
    count = signals.shape[0]
    last = int(newest[i]) % slots  # whatever a state holds that was restored
    head = (last + 1) % slots
    place = min(max(late, 0.0), slots - 1.001)
    whole = int(place)
    newer, older = (head - whole) % slots, (head - whole - 1) % slots
    for k in range(count):
        if math.isnan(kept[last * count + k, i]):
            for slot in range(slots):
                kept[slot * count + k, i] = signals[k, i]
        kept[head * count + k, i] = signals[k, i]
        later = kept[newer * count + k, i]
        then[k, i] = later + (place - whole) * (kept[older * count + k, i] - later)
    newest[i] = head
