"""Motion of the end effector from its acceleration between position samples that are rare, noisy and late.

On each axis, with the acceleration a that a sensor feels and its bias b,
    x' = v,  v' = a - b,  b' = 0
runs at the control rate. It needs neither forces nor a mass, so friction that turns, pressures and the hand leave it alone.
A position sample corrects it as in ``observers``, by the difference to what was believed when that sample was taken:
1 - e^3, 3/2 (1 - e)^2 (1 + e)/Ts and -(1 - e)^3/Ts^2 times the difference are added to x, v and b. They place a triple pole at
e = exp(-w Ts). What a sample says is carried on over its age.

Noise of 0.02 m/s2 at 1 kHz and of 0.1 mm at 240 Hz have their Kalman filter at w = (q/r)^(1/4) = 10 1/s, with the densities
q = 4e-7 m2/s3 and r = 4.2e-11 m2 s; the speed is then known to 0.24 mm/s. Friction turns within 0.24 mm of motion.
"""

from __future__ import annotations

import numpy as np

from baselines.staged import LawStage
from birthsim_env.loop.rows import ACCELERATION, HANDED, POSITION, POSITION_TIME, SEEN, TIME, VELOCITY
from birthsim_env.loop.stage import block, numbers
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

BANDWIDTH = 12.0
"""w, 1/s; a little more than that of the Kalman filter, so that a bias may drift."""

START, START_TIME = 50.0, 0.15
"""1/s and s; assumed: at a start, where bias and speed are unknown, w is larger by so much, which decays with this time."""

X, V, BIAS, FRESH, LAST, SLOT, BEGAN, HISTORY = 0, 2, 4, 6, 7, 8, 9, 10
"""Rows at which parts of the memory begin: x, y (m); their rates; biases, m/s2; 1 at a new start; time of the newest sample, s;
where in the history the present stands; time of the start, s; past x, y, a ring."""

PERIOD, WIDTH, ROWS, CONSTANTS = range(4)
"""Constants of the stage: control period, s; w, 1/s; rows of the memory. ``CONSTANTS`` is their number."""


def memory_rows(rig: Parameters) -> int:
    """Rows of the memory that a rig's tracker asks for."""
    board = rig.electronics
    return HISTORY + 2 * (int((board.position_latency + 1 / board.position_rate) / board.control_period) + 4)


@helper
def observe(
    memory: Array, time: Array, position: Array, position_time: Array, velocity: Array, acceleration: Array, period: float,
    bandwidth: float, motion: Array,
) -> None:  # fmt: skip
    """Carries ``memory`` (M, N) on by one period and writes ``motion`` (4, N): x, y (m), vx, vy (m/s) now.

    ``velocity`` (2, N), m/s, counts at a new start only.
    """
    depth = (memory.shape[0] - HISTORY) // 2
    for i in range(time.shape[0]):
        slot = (int(memory[SLOT, i]) + 1) % depth
        sampled, fresh = position_time[i] - memory[LAST, i], memory[FRESH, i] > 0.0
        if fresh:
            memory[BEGAN, i] = time[i]
        # The memory goes no further back than the rig's own description of its tracker.
        age = min(time[i] - position_time[i], (depth - 2) * period)
        memory[SLOT, i], memory[LAST, i], memory[FRESH, i] = slot, position_time[i], 0.0
        periods = age / period
        back = int(periods)
        part = periods - back
        width = bandwidth + START * exact.exp(-(time[i] - memory[BEGAN, i]) / START_TIME)
        kept = exact.exp(-width * max(sampled, 0.0))
        for axis in range(2):
            if fresh:
                memory[X + axis, i], memory[V + axis, i], memory[BIAS + axis, i] = position[axis, i], velocity[axis, i], 0.0
                for k in range(depth):
                    memory[HISTORY + 2 * k + axis, i] = position[axis, i]
            else:
                rate = acceleration[axis, i] - memory[BIAS + axis, i]
                memory[X + axis, i] += period * (memory[V + axis, i] + 0.5 * period * rate)
                memory[V + axis, i] += period * rate
                memory[HISTORY + 2 * slot + axis, i] = memory[X + axis, i]
            if sampled > 0.0 and not fresh:
                newer = memory[HISTORY + 2 * ((slot - back) % depth) + axis, i]
                older = memory[HISTORY + 2 * ((slot - back - 1) % depth) + axis, i]
                innovation = position[axis, i] - (newer + part * (older - newer))
                to_position = 1.0 - kept**3
                to_speed = 1.5 * (1.0 - kept) ** 2 * (1.0 + kept) / sampled
                to_rate = (1.0 - kept) ** 3 / sampled**2
                # What the sample says of its own instant is carried on to the present.
                for k in range(depth):
                    since = age - k * period
                    change = to_position + since * (to_speed + 0.5 * since * to_rate)
                    memory[HISTORY + 2 * ((slot - k) % depth) + axis, i] += change * innovation
                memory[X + axis, i] = memory[HISTORY + 2 * slot + axis, i]
                memory[V + axis, i] += (to_speed + to_rate * age) * innovation
                memory[BIAS + axis, i] -= to_rate * innovation
            motion[axis, i], motion[2 + axis, i] = memory[X + axis, i], memory[V + axis, i]


@kernel
def stage(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes x, y, vx, vy to the first rows of ``HANDED``."""
    s, about = block(seen, SEEN), numbers(constants, CONSTANTS)
    observe(
        block(memory, int(about[ROWS]))[:, :n], s[TIME, :n], s[POSITION:VELOCITY, :n], s[POSITION_TIME, :n],
        s[VELOCITY:POSITION_TIME, :n], s[ACCELERATION : ACCELERATION + 2, :n], about[PERIOD], about[WIDTH],
        s[HANDED : HANDED + 4, :n],
    )  # fmt: skip
    return 0


def law_stage(rig: Parameters) -> LawStage:
    """The stage for a rig as believed."""
    rows = memory_rows(rig)
    fresh = np.zeros(rows)
    fresh[FRESH] = 1.0
    return LawStage(stage, np.array([rig.electronics.control_period, BANDWIDTH, rows]), fresh, feels=True)
