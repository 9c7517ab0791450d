"""Motion of the end effector from its acceleration between position samples that are rare, noisy and late.

On each axis, with the acceleration a that a sensor measures and its bias b,
    x' = v,  v' = a - b,  b' = 0
runs at the control rate. It needs neither forces nor a mass, so friction that turns, pressures and the hand leave it alone.
A position sample corrects it as in ``observers``, by the difference to what was believed when that sample was taken:
1 - e^3, 3/2 (1 - e)^2 (1 + e)/Ts and -(1 - e)^3/Ts^2 times the difference are added to x, v and b. They place a triple pole at
e = exp(-w Ts). A sample's correction is carried on over its age.

Noise of 0.02 m/s2 at 1 kHz and of 0.1 mm at 240 Hz have their Kalman filter at w = (q/r)^(1/4) = 10 1/s, with the densities
q = 4e-7 m2/s3 and r = 4.2e-11 m2 s; the speed is then known to 0.24 mm/s. Friction turns within 0.24 mm of motion.
"""

import numpy as np

from baselines.staged import ControllerStage
from birthsim_env.loop.rows import Seen, Signals
from birthsim_env.loop.signals import Point
from birthsim_env.loop.stage import block
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows
from birthsim_env.physics.rig.parameters import Parameters

BANDWIDTH = 12.0
"""w, 1/s; a little more than that of the Kalman filter, so that a bias may drift."""

START, START_TIME = 50.0, 0.15
"""1/s and s; assumed: at a start, where bias and speed are unknown, w is larger by so much, which decays with this time."""


class Memory(Rows):
    """What the observer remembers."""

    position = rows("x y", "m", "position")
    velocity = rows("vx vy", "m/s", "velocity")
    bias = rows("bx by", "m/s2", "bias of the acceleration")
    fresh = row("1", "1 at a new start")
    newest = row("s", "time of the newest sample")
    slot = row("1", "where in the past the present stands")
    began = row("s", "time of the start")
    past = rows(0, "m", "x, y of the last periods in turns, a ring")


class Moving(Point):
    """What the stage hands on."""

    acceleration = rows("ax ay", "m/s2", "acceleration without the bias of its sensor")


class Gains(Numbers):
    """Constants of the stage."""

    period = number("s", "control period")
    bandwidth = number("1/s", "bandwidth w")
    rows_of_memory = number("1", "rows of the memory")


@helper
def observe(memory: Memory, signals: Signals, constants: Gains, point: Moving) -> None:
    """Carries ``memory`` on by one period and writes ``point``, where and how fast the end effector is now.

    The measured velocity counts at a new start only.
    """
    past, period = memory.past, constants.period
    depth = past.shape[0] // 2
    for i in range(signals.time.shape[0]):
        time, slot = signals.time[i], (int(memory.slot[i]) + 1) % depth
        sampled, fresh = signals.position_time[i] - memory.newest[i], memory.fresh[i] > 0.0
        if fresh:
            memory.began[i] = time
        # The memory goes no further back than the rig's own description of its tracker.
        age = min(time - signals.position_time[i], (depth - 2) * period)
        memory.slot[i], memory.newest[i], memory.fresh[i] = slot, signals.position_time[i], 0.0
        periods = age / period
        back = int(periods)
        part = periods - back
        width = constants.bandwidth + START * exact.exp(-(time - memory.began[i]) / START_TIME)
        kept = exact.exp(-width * max(sampled, 0.0))
        for axis in range(2):
            if fresh:
                memory.position[axis, i], memory.velocity[axis, i] = signals.position[axis, i], signals.velocity[axis, i]
                memory.bias[axis, i] = 0.0
                for k in range(depth):
                    past[2 * k + axis, i] = signals.position[axis, i]
            else:
                rate = signals.acceleration[axis, i] - memory.bias[axis, i]
                memory.position[axis, i] += period * (memory.velocity[axis, i] + 0.5 * period * rate)
                memory.velocity[axis, i] += period * rate
                past[2 * slot + axis, i] = memory.position[axis, i]
            if sampled > 0.0 and not fresh:
                newer = past[2 * ((slot - back) % depth) + axis, i]
                older = past[2 * ((slot - back - 1) % depth) + axis, i]
                innovation = signals.position[axis, i] - (newer + part * (older - newer))
                to_position = 1.0 - kept**3
                to_speed = 1.5 * (1.0 - kept) ** 2 * (1.0 + kept) / sampled
                to_rate = (1.0 - kept) ** 3 / sampled**2
                # The correction of the sample's own instant is carried on to the present.
                for k in range(depth):
                    since = age - k * period
                    change = to_position + since * (to_speed + 0.5 * since * to_rate)
                    past[2 * ((slot - k) % depth) + axis, i] += change * innovation
                memory.position[axis, i] = past[2 * slot + axis, i]
                memory.velocity[axis, i] += (to_speed + to_rate * age) * innovation
                memory.bias[axis, i] -= to_rate * innovation
            point.position[axis, i], point.velocity[axis, i] = memory.position[axis, i], memory.velocity[axis, i]
            point.acceleration[axis, i] = signals.acceleration[axis, i] - memory.bias[axis, i]


@kernel
def stage(world: int, seen: Seen, memory: int, constants: Gains, tables: int, lane: int, n: int) -> int:
    """Writes ``Moving`` to the first rows that are handed on."""
    signals = Seen(seen.rows[:, :n])
    own = Memory(block(memory, int(constants.rows_of_memory))[:, :n])
    observe(own, signals, constants, Moving(signals.intermediate[: Moving.size]))
    return 0


def controller_stage(rig: Parameters) -> ControllerStage:
    """The stage for a rig as believed, which remembers as much as its tracker asks for."""
    board = rig.electronics
    periods = int((board.position_latency + 1 / board.position_rate) / board.control_period) + 4
    fresh = Memory.lane(fresh=1.0, past=np.zeros(2 * periods))
    constants = Gains.numbers(period=board.control_period, bandwidth=BANDWIDTH, rows_of_memory=len(fresh))
    return ControllerStage(stage, constants, fresh, reads_acceleration=True)
