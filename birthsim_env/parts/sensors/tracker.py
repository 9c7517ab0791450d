"""A tracker's clock: when it takes samples, when they arrive, and the velocity that is worked out from them.

An encoder has one too: what is called the position of the end effector here is then that of both pistons.

``queue`` (Q, 3, N) holds the last samples taken, each a ``Sample``.
"""

import math

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows


class Sample(Rows):
    """Where the tracker was."""

    position = rows("x y", "m", "of the end effector")
    time = row("s", "when the sample was taken")


class Arrived(Sample):
    """The newest sample that has arrived."""

    velocity = rows("vx vy", "m/s", "low-passed differences of the samples")


RATE_TIME = 0.02
"""s; assumed: time constant of the low-pass on a tracker's position differences, which stand for the velocity."""


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
    sample = Sample(queue[slot])
    sample.position[0, i], sample.position[1, i], sample.time[i] = x, y, time


@helper
def start(queue: Array, arrived: Arrived, i: int, x: float, y: float, vx: float, vy: float) -> None:
    """The tracker has run before the episode: its first sample, (``x``, ``y``), is there at once."""
    for k in range(queue.shape[0]):
        sample = Sample(queue[k])
        sample.position[0, i], sample.position[1, i], sample.time[i] = x, y, 0.0
    arrived.position[0, i], arrived.position[1, i], arrived.time[i] = x, y, 0.0
    arrived.velocity[0, i], arrived.velocity[1, i] = vx, vy


@helper
def arrive(queue: Array, arrived: Arrived, i: int, time: float, latency: float, rate_time: float) -> None:
    """Let arrive what has been under way for ``latency`` s; ``rate_time``, s, is the time constant of the velocity."""
    for k in range(queue.shape[0]):
        sample = Sample(queue[k])
        if sample.time[i] > arrived.time[i] and sample.time[i] + latency <= time + 1e-9:
            step = sample.time[i] - arrived.time[i]
            fraction = step / (rate_time + step)
            for axis in range(2):
                moved = sample.position[axis, i] - arrived.position[axis, i]
                arrived.velocity[axis, i] += fraction * (moved / step - arrived.velocity[axis, i])
                arrived.position[axis, i] = sample.position[axis, i]
            arrived.time[i] = sample.time[i]
