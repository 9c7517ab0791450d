"""Piston speed from position samples that are rare, noisy and late.

A Luenberger observer with a disturbance state runs at the control rate on the control model; pressures are measured at every
period:
    y' = v,  v' = f(y, v) + g F + d,  d' = 0
The disturbance d is an acceleration. It stands for what the observer is not given: Coulomb friction, the model's errors, and
the user's force where it is not measured.

When a position sample arrives, the observer is corrected by the difference to what it believed when that sample was taken.
The corrections of y, v and d are 1 - e^3, 3/2 (1 - e)^2 (1 + e)/Ts and (1 - e)^3/Ts^2 times this difference. They place a
triple pole at e = exp(-w Ts), whatever the time Ts between samples. They are carried on over the sample's age.

Friction holds a resting piston still. An observer that knows this averages the noise away. While a piston rests,
    v' = ... - 2 wr v,  d' = -wr^2 v    (the pseudo-measurement v = 0 with a double pole wr: d is what friction carries)
and position samples move y alone, by 1 - exp(-ws Ts). A piston counts as resting once it is slow. It no longer does when the
low-passed innovation is larger than noise explains, or when the observer is given that the reference moves.
"""

import numpy as np

from baselines.estimation.disturbance_observer import accelerations
from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from birthsim_env.loop.rows import Signals
from birthsim_env.loop.signals import Joints, Measurement, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion, pistons_at
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


@helper
def begin(pistons: Pistons, i: int, point: Point, p: Rig, joints: Joints) -> None:
    """Starts lane ``i`` anew where the one lane of ``point`` places the pistons; ``joints`` is scratch."""
    past = pistons.past
    piston_motion(point.rows, p, joints.rows, 1)
    pistons.fresh[i] = 0.0
    for cylinder in range(2):
        pistons.position[cylinder, i], pistons.speed[cylinder, i] = joints.position[cylinder, 0], joints.speed[cylinder, 0]
        pistons.disturbance[cylinder, i], pistons.rest[cylinder, i], pistons.innovation[cylinder, i] = 0.0, 0.0, 0.0
        pistons.reluctance[cylinder, i] = 1.0
        for k in range(past.shape[0] // 2):
            past[2 * k + cylinder, i] = joints.position[cylinder, 0]


@helper
def predict(pistons: Pistons, i: int, pressures: Array, inputs: Inputs, p: Rig, period: float) -> float:
    """Carries positions and speeds of lane ``i`` on by one period of the model; returns kappa where it began."""
    position, speed = pistons.position, pistons.speed
    y1, y2 = position[0, i], position[1, i]
    v1, v2 = speed[0, i], speed[1, i]
    a1, a2, kappa = accelerations(pistons, i, pressures, inputs, p)
    a1, a2 = a1 + pistons.disturbance[0, i], a2 + pistons.disturbance[1, i]
    position[0, i] = min(max(y1 + period * (v1 + 0.5 * period * a1), -p.half_l1), p.half_l1)
    position[1, i] = min(max(y2 + period * (v2 + 0.5 * period * a2), -p.half_l2), p.half_l2)
    speed[0, i], speed[1, i] = v1 + period * a1, v2 + period * a2
    return kappa


@helper
def rest(pistons: Pistons, i: int, moving: float, period: float, held: float) -> None:
    """Brakes resting pistons of lane ``i``, and finds how far they rest; ``held`` is exp(-wr period)."""
    for cylinder in range(2):
        speed, resting, reluctance = pistons.speed[cylinder, i], pistons.rest[cylinder, i], pistons.reluctance[cylinder, i]
        pistons.speed[cylinder, i] = speed - resting * (1.0 - held * held) * speed
        pistons.disturbance[cylinder, i] -= resting * (1.0 - held) ** 2 / period * speed
        reluctance += (1.0 - reluctance) * min(period / TRUST_TIME, 1.0)
        settling = min(period / (REST_TIME * reluctance), 1.0)
        slow = abs(pistons.speed[cylinder, i]) < REST_SPEED
        pistons.reluctance[cylinder, i] = reluctance
        pistons.rest[cylinder, i] = (1.0 - moving) * (resting + (1.0 - resting) * settling if slow else resting)


@helper
def correct(
    pistons: Pistons,
    i: int,
    joints: Joints,
    sampled: float,
    age: float,
    assumed: AssumedParameters,
    explained: tuple[float, float],
) -> None:
    """Takes a sample: the pistons stood at the one lane of ``joints`` an ``age`` ago, ``sampled`` s after the last one.

    A low-passed innovation beyond what is ``explained`` of each piston, m, ends its rest.
    """
    (explained1, explained2), past = explained, pistons.past
    slot, period = int(pistons.slot[i]), assumed.period
    depth, periods = past.shape[0] // 2, age / period
    back = min(int(periods), depth - 2)
    part = min(periods - back, 1.0)
    for cylinder in range(2):
        newer = past[2 * ((slot - back) % depth) + cylinder, i]
        older = past[2 * ((slot - back - 1) % depth) + cylinder, i]
        innovation = joints.position[cylinder, 0] - (newer + part * (older - newer))
        pistons.innovation[cylinder, i] += INNOVATION_FRACTION * (innovation - pistons.innovation[cylinder, i])
        resting = pistons.rest[cylinder, i]
        if abs(pistons.innovation[cylinder, i]) > (explained1 if cylinder == 0 else explained2):
            pistons.reluctance[cylinder, i] *= 1.0 + RELUCTANCE * resting
            pistons.rest[cylinder, i], resting = 0.0, 0.0
        kept = exact.exp(-assumed.bandwidth * sampled)
        to_position = (1.0 - resting) * (1.0 - kept**3) + resting * (1.0 - exact.exp(-SLOW_BANDWIDTH * sampled))
        to_speed = (1.0 - resting) * 1.5 * (1.0 - kept) ** 2 * (1.0 + kept) / sampled
        to_disturbance = (1.0 - resting) * (1.0 - kept) ** 3 / sampled**2
        # The correction of the sample's own instant is carried on to the present: late samples do not destabilise.
        for k in range(depth):
            since = age - k * period
            change = to_position + since * (to_speed + 0.5 * since * to_disturbance)
            past[2 * ((slot - k) % depth) + cylinder, i] += change * innovation
        pistons.position[cylinder, i] = past[2 * slot + cylinder, i]
        pistons.speed[cylinder, i] += (to_speed + to_disturbance * age) * innovation
        pistons.disturbance[cylinder, i] += to_disturbance * innovation


@helper
def observe(pistons: Pistons, signals: Signals, pressures: Array, inputs: Inputs, assumed: AssumedParameters) -> None:
    """One control period of N lanes, in which positions are samples and pressures (4, N), Pa, are known."""
    p, period, held = assumed.rig, assumed.period, exact.exp(-REST_BANDWIDTH * assumed.period)
    past, point, joints = pistons.past, Point(scratch(Point.size)), Joints(scratch(Joints.size))
    depth = past.shape[0] // 2
    for i in range(signals.time.shape[0]):
        slot = (int(pistons.slot[i]) + 1) % depth
        sampled = signals.position_time[i] - pistons.newest[i]
        # The memory goes no further back than the rig's own description of its tracker.
        age = min(signals.time[i] - signals.position_time[i], (depth - 1) * period)
        pistons.slot[i], pistons.newest[i] = slot, signals.position_time[i]
        for axis in range(2):
            point.position[axis, 0], point.velocity[axis, 0] = signals.position[axis, i], signals.velocity[axis, i]
        if pistons.fresh[i] > 0.0:
            begin(pistons, i, point, p, joints)
            continue
        kappa = predict(pistons, i, pressures, inputs, p, period)
        rest(pistons, i, inputs.moving[i], period, held)
        past[2 * slot, i], past[2 * slot + 1, i] = pistons.position[0, i], pistons.position[1, i]
        if sampled > 0.0:
            piston_motion(point.rows, p, joints.rows, 1)
            explained = STIR * inputs.noise[i]
            correct(pistons, i, joints, sampled, age, assumed, (explained / kappa, explained))


def measured_joints(measurement: Measurement, lane_parameters: Array) -> Array:
    """y1, y2 (m), v1, v2 (m/s), (4, N), where position and velocity are measured at every control period."""
    joints = np.empty((Joints.size, measurement.position.shape[1]))
    pistons_at(np.concatenate([measurement.position, measurement.velocity]), Rig(lane_parameters), joints)
    return joints


def fresh_memory(rig: Parameters, sampled: bool) -> Array:
    """``Pistons`` of a lane that starts, which remember as much as a rig's tracker asks for where positions are samples."""
    board = rig.electronics
    periods = int((board.position_latency + 1 / board.position_rate) / board.control_period) + 4 if sampled else 0
    return Pistons.lane(fresh=1.0, past=np.zeros(2 * periods))


def assumed_parameters(rig: Parameters, bandwidth: float = BANDWIDTH) -> Array:
    """``AssumedParameters`` in a rig."""
    board = rig.electronics
    return AssumedParameters.numbers(
        period=board.control_period, bandwidth=bandwidth, noise=board.position_noise, rig=parameter_column(rig)
    )
