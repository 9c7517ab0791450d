"""A tracker's clock: when it takes samples, when they arrive, and the velocity that is worked out from them.

``queue`` (Q, 3, N) holds x, y and time of the last samples taken; ``shown`` (3, N) the newest that has arrived; ``velocity``
(2, N) the low-passed differences of those.
"""

from __future__ import annotations

import math

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

RATE_TIME = 0.02
"""s; assumed: time constant of the low-pass on the position differences that are shown as velocity."""


def slots(rate: float, latency: float) -> int:
    """Q for a tracker: two samples can be under way beyond those that the latency holds back."""
    return int(latency * rate) + 3


@helper
def sample_due(tick: int, time: float, period: float, rate: float) -> bool:
    """Whether a sample is taken at this control instant: the first one since the tracker's clock has struck."""
    return tick == 0 or math.floor(time * rate + 1e-9) > math.floor((time - period) * rate + 1e-9)


@helper
def take(queue: Array, i: int, time: float, rate: float, x: float, y: float) -> None:
    """Put a sample into the queue of lane ``i``."""
    slot = math.floor(time * rate + 1e-9) % queue.shape[0]
    queue[slot, 0, i], queue[slot, 1, i], queue[slot, 2, i] = x, y, time


@helper
def start(queue: Array, shown: Array, velocity: Array, i: int, x: float, y: float, vx: float, vy: float) -> None:
    """The tracker has run before the episode: its first sample, (``x``, ``y``), is there at once."""
    for k in range(queue.shape[0]):
        queue[k, 2, i] = 0.0
        queue[k, 0, i], queue[k, 1, i] = x, y
    shown[0, i], shown[1, i], shown[2, i] = x, y, 0.0
    velocity[0, i], velocity[1, i] = vx, vy


@helper
def arrive(queue: Array, shown: Array, velocity: Array, i: int, time: float, latency: float) -> None:
    """Show what has been under way for ``latency`` s."""
    for k in range(queue.shape[0]):
        if queue[k, 2, i] > shown[2, i] and queue[k, 2, i] + latency <= time + 1e-9:
            step = queue[k, 2, i] - shown[2, i]
            fraction = step / (RATE_TIME + step)
            for axis in range(2):
                velocity[axis, i] += fraction * ((queue[k, axis, i] - shown[axis, i]) / step - velocity[axis, i])
                shown[axis, i] = queue[k, axis, i]
            shown[2, i] = queue[k, 2, i]
