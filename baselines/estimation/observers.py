"""Piston speed from position samples that are rare, noisy and late.

A Luenberger observer with a disturbance state runs at the control rate on the control model; pressures are measured at every
period:
    y' = v,  v' = f(y, v) + g F + d,  d' = 0
The disturbance d is an acceleration. It stands for what the observer is not told: Coulomb friction, the model's errors, and
the user's force where it is not measured.

When a position sample arrives, the observer is corrected by the difference to what it believed when that sample was taken.
The corrections of y, v and d are 1 - e^3, 3/2 (1 - e)^2 (1 + e)/Ts and (1 - e)^3/Ts^2 times this difference. They place a
triple pole at e = exp(-w Ts), whatever the time Ts between samples. They are carried on over the sample's age.

Friction holds a resting piston still. An observer that knows this averages the noise away. While a piston rests,
    v' = ... - 2 wr v,  d' = -wr^2 v    (the pseudo-measurement v = 0 with a double pole wr: d is what friction carries)
and position samples move y alone, by 1 - exp(-ws Ts). A piston counts as resting once it is slow. It no longer does when the
low-passed innovation is larger than noise explains, or when the user of the observer says that the reference moves.
"""

from __future__ import annotations

import numpy as np

from baselines.estimation.disturbance_observer import accelerations
from birthsim_env.loop.signals import Measurement
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.parameters import Parameters

BANDWIDTH = 70.0
"""1/s; assumed: as fast as 0.1 mm of noise at 240 Hz allows the valves without chatter."""

REST_BANDWIDTH = 110.0
"""wr, 1/s: how fast friction takes up the load of a resting piston; found by trial like the next five."""

SLOW_BANDWIDTH = 10.0
"""ws, 1/s, of the position of a resting piston."""

REST_SPEED = 6e-3
"""m/s: a slower piston may come to rest."""

REST_TIME = 0.1
"""s: time constant with which a slow piston comes to count as resting."""

RELUCTANCE = 5.0
"""Relative growth of ``REST_TIME`` after a rest that ends without a command. A piston that starts to move without a command has
little friction, so the next rest is assumed later."""

TRUST_TIME = 20.0
"""s: time constant with which the growth of ``REST_TIME`` decays."""

INNOVATION_FRACTION = 0.3
"""Weight of a new innovation in the low-passed one."""

STIR = 1.9
"""Low-passed innovation that ends a rest, in standard deviations of the position noise: 4.5 of the low-passed noise."""


ESTIMATE, SPEED, DISTURBANCE, REST, INNOVATION, RELUCTANT, FRESH, LAST, SLOT, HISTORY = 0, 2, 4, 6, 8, 10, 12, 13, 14, 15
"""Rows at which parts of an observer's memory begin: y1, y2, m; v1, v2, m/s; d1, d2, m/s2; how far each piston rests, 0 to 1;
low-passed innovations, m; factors of ``REST_TIME``; 1 at a new start; time of the newest sample, s; where in the history the
present stands; past y1, y2, a ring."""


@helper
def begin(memory: Array, i: int, motion: Array, p: Array, joints: Array) -> None:
    """Starts lane ``i`` anew where ``motion`` (4, 1), x, y, vx, vy, places the pistons; ``joints`` (4, 1) is scratch."""
    history = memory[HISTORY:]
    piston_motion(motion, p, joints, 1)
    memory[FRESH, i] = 0.0
    for cylinder in range(2):
        memory[ESTIMATE + cylinder, i], memory[SPEED + cylinder, i] = joints[cylinder, 0], joints[2 + cylinder, 0]
        memory[DISTURBANCE + cylinder, i], memory[REST + cylinder, i], memory[INNOVATION + cylinder, i] = 0.0, 0.0, 0.0
        memory[RELUCTANT + cylinder, i] = 1.0
        for k in range(history.shape[0] // 2):
            history[2 * k + cylinder, i] = joints[cylinder, 0]


@helper
def predict(memory: Array, i: int, pressures: Array, force: Array, believed: Array, p: Array, period: float) -> float:
    """Carries positions and speeds of lane ``i`` on by one period of the model; returns kappa where it began."""
    y1, y2, v1, v2 = memory[ESTIMATE, i], memory[ESTIMATE + 1, i], memory[SPEED, i], memory[SPEED + 1, i]
    a1, a2, kappa = accelerations(y1, y2, v1, v2, i, pressures, force, believed, p)
    a1, a2 = a1 + memory[DISTURBANCE, i], a2 + memory[DISTURBANCE + 1, i]
    memory[ESTIMATE, i] = min(max(y1 + period * (v1 + 0.5 * period * a1), -p[at.HALF_L1]), p[at.HALF_L1])
    memory[ESTIMATE + 1, i] = min(max(y2 + period * (v2 + 0.5 * period * a2), -p[at.HALF_L2]), p[at.HALF_L2])
    memory[SPEED, i], memory[SPEED + 1, i] = v1 + period * a1, v2 + period * a2
    return kappa


@helper
def rest(memory: Array, i: int, moving: float, period: float, held: float) -> None:
    """Brakes resting pistons of lane ``i``, and finds how far they rest; ``held`` is exp(-wr period)."""
    for cylinder in range(2):
        speed, resting, reluctance = memory[SPEED + cylinder, i], memory[REST + cylinder, i], memory[RELUCTANT + cylinder, i]
        memory[SPEED + cylinder, i] = speed - resting * (1.0 - held * held) * speed
        memory[DISTURBANCE + cylinder, i] -= resting * (1.0 - held) ** 2 / period * speed
        reluctance += (1.0 - reluctance) * min(period / TRUST_TIME, 1.0)
        settling = min(period / (REST_TIME * reluctance), 1.0)
        slow = abs(memory[SPEED + cylinder, i]) < REST_SPEED
        memory[RELUCTANT + cylinder, i] = reluctance
        memory[REST + cylinder, i] = (1.0 - moving) * (resting + (1.0 - resting) * settling if slow else resting)


@helper
def correct(
    memory: Array, i: int, joints: Array, sampled: float, age: float, period: float, bandwidth: float, explained1: float,
    explained2: float,
) -> None:  # fmt: skip
    """Takes a sample: the pistons stood at ``joints`` (2 or more, 1) an ``age`` ago, ``sampled`` s after the last one.

    A low-passed innovation beyond ``explained1`` or ``explained2``, m, ends the rest of that piston.
    """
    history, slot = memory[HISTORY:], int(memory[SLOT, i])
    depth, periods = history.shape[0] // 2, age / period
    back = min(int(periods), depth - 2)
    part = min(periods - back, 1.0)
    for cylinder in range(2):
        newer = history[2 * ((slot - back) % depth) + cylinder, i]
        older = history[2 * ((slot - back - 1) % depth) + cylinder, i]
        innovation = joints[cylinder, 0] - (newer + part * (older - newer))
        memory[INNOVATION + cylinder, i] += INNOVATION_FRACTION * (innovation - memory[INNOVATION + cylinder, i])
        resting = memory[REST + cylinder, i]
        if abs(memory[INNOVATION + cylinder, i]) > (explained1 if cylinder == 0 else explained2):
            memory[RELUCTANT + cylinder, i] *= 1.0 + RELUCTANCE * resting
            memory[REST + cylinder, i], resting = 0.0, 0.0
        kept = exact.exp(-bandwidth * sampled)
        to_position = (1.0 - resting) * (1.0 - kept**3) + resting * (1.0 - exact.exp(-SLOW_BANDWIDTH * sampled))
        to_speed = (1.0 - resting) * 1.5 * (1.0 - kept) ** 2 * (1.0 + kept) / sampled
        to_disturbance = (1.0 - resting) * (1.0 - kept) ** 3 / sampled**2
        # What the sample says of its own instant is carried on to the present: late samples do not destabilise.
        for k in range(depth):
            since = age - k * period
            change = to_position + since * (to_speed + 0.5 * since * to_disturbance)
            history[2 * ((slot - k) % depth) + cylinder, i] += change * innovation
        memory[ESTIMATE + cylinder, i] = history[2 * slot + cylinder, i]
        memory[SPEED + cylinder, i] += (to_speed + to_disturbance * age) * innovation
        memory[DISTURBANCE + cylinder, i] += to_disturbance * innovation


@helper
def observe(
    memory: Array, time: Array, position: Array, position_time: Array, velocity: Array, pressures: Array, p: Array,
    period: float, bandwidth: float, noise: Array, force: Array, believed: Array, moving: Array,
) -> None:  # fmt: skip
    """One control period; carries ``memory`` (M, N) on.

    ``noise`` (N,), m, of a position sample; ``force`` (2, N) the user's, N, and ``believed`` (2, N), N along the pistons, as
    known; ``moving`` (N,) 1 where no piston may rest.
    """
    history, held = memory[HISTORY:], exact.exp(-REST_BANDWIDTH * period)
    depth, motion, joints = history.shape[0] // 2, scratch(4), scratch(4)
    for i in range(time.shape[0]):
        slot = (int(memory[SLOT, i]) + 1) % depth
        sampled = position_time[i] - memory[LAST, i]
        # The memory goes no further back than the rig's own description of its tracker.
        age = min(time[i] - position_time[i], (depth - 1) * period)
        memory[SLOT, i], memory[LAST, i] = slot, position_time[i]
        motion[0, 0], motion[1, 0], motion[2, 0], motion[3, 0] = position[0, i], position[1, i], velocity[0, i], velocity[1, i]
        if memory[FRESH, i] > 0.0:
            begin(memory, i, motion, p, joints)
            continue
        kappa = predict(memory, i, pressures, force, believed, p, period)
        rest(memory, i, moving[i], period, held)
        history[2 * slot, i], history[2 * slot + 1, i] = memory[ESTIMATE, i], memory[ESTIMATE + 1, i]
        if sampled > 0.0:
            piston_motion(motion, p, joints, 1)
            correct(memory, i, joints, sampled, age, period, bandwidth, STIR * noise[i] / kappa, STIR * noise[i])


@kernel
def _measured_joints(position: Array, velocity: Array, p: Array, joints: Array) -> None:
    motion, one = np.empty((4, 1)), np.empty((4, 1))
    for i in range(position.shape[1]):
        motion[0, 0], motion[1, 0] = position[0, i], position[1, i]
        motion[2, 0], motion[3, 0] = velocity[0, i], velocity[1, i]
        piston_motion(motion, p, one, 1)
        for row in range(4):
            joints[row, i] = one[row, 0]


def measured_joints(measurement: Measurement, lane_parameters: Array) -> Array:
    """y1, y2 (m), v1, v2 (m/s), (4, N), where position and velocity are measured at every control period."""
    joints = np.empty((4, measurement.position.shape[1]))
    _measured_joints(measurement.position, measurement.velocity, lane_parameters, joints)
    return joints


def fresh_memory(rig: Parameters) -> Array:
    """The memory of a lane that starts, as deep as a rig's tracker asks for."""
    board = rig.electronics
    fresh = np.zeros(HISTORY + 2 * (int((board.position_latency + 1 / board.position_rate) / board.control_period) + 4))
    fresh[FRESH] = 1.0
    return fresh
