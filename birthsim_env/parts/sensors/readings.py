"""What a board reads in a control period: forces, an acceleration, pressures, and what it then shows a controller."""

import math

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.parts.sensors import acceleration
from birthsim_env.parts.sensors.cells import pressure_at_cell
from birthsim_env.parts.sensors.noise import happens, noise_of
from birthsim_env.parts.sensors.sensor_errors import Errors, Shared
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows

NOISE_OF_FORCE, MISSED = 6, 9
"""Channels of random numbers; the pressures have the first four."""


class Readings(Rows):
    """What the sensors say, which stays as it is in a missed period."""

    position = rows("x y", "m", "of the end effector")
    position_time = row("s", "when the position was measured")
    velocity = rows("vx vy", "m/s", "of the end effector")
    pressure = rows("P1 N1 P2 N2", "Pa", "of the chambers")
    force = rows("x y", "N", "of the hand")
    acceleration = rows("x y", "m/s2", "of the end effector")


@helper
def converted(value: float, step: float, least: float, most: float) -> float:
    """``value`` as a converter with a ``step`` tells it; a step of 0 is no converter."""
    return max(least, min(most, exact.rounded(value, step))) if step > 0.0 else value


@helper
def late_force(
    sensed: float,
    axis: int,
    passed: Array,
    late: Array,
    e: Errors,
    shared: Shared,
    key: np.uint64,
    tick: int,
    again: bool,
    i: int,
    noise: float,
    step: float,
    full: float,
) -> float:
    """What channel ``axis`` of a force tells now of what it senses, N: behind its low-pass, with noise, converted, late.

    ``again`` is True where the same period is looked at once more; ``full`` is full scale, N.
    """
    slots = late.shape[0]
    whole = math.floor(e.delay[i] + 1e-9)
    rest = max(0.0, e.delay[i] - whole)
    newest, earlier = tick - int(whole), tick - int(whole) - 1
    share = 1.0 if tick == 0 else e.passed[i]
    if not again:
        passed[axis, i] = passed[axis, i] + share * (sensed - passed[axis, i]) if share < 1.0 else sensed
    value = passed[axis, i] + noise_of(key, tick, NOISE_OF_FORCE + axis, noise)
    value = converted(value, step, -full, full)
    for k in range(slots if tick == 0 else 1):
        late[(tick + k) % slots, axis, i] = value
    newer = late[newest % slots, axis, i]
    told: float = newer + rest * (late[earlier % slots, axis, i] - newer)
    return told


@helper
def sense_force(
    world: World,
    readings: Readings,
    passed: Array,
    late: Array,
    e: Errors,
    shared: Shared,
    key: np.uint64,
    again: bool,
    read: bool,
    i: int,
) -> None:
    """Read the force sensor at the head."""
    tick = int(world.tick[i])
    for axis in range(2):
        force = world.force[axis, i]
        sensed = force + (e.gain[axis, i] * force + e.crosstalk[axis, i] * world.force[1 - axis, i]) + e.bias[axis, i]
        noise, step = e.parameters.force_noise[i], e.force_step[i]
        told = late_force(sensed, axis, passed, late, e, shared, key, tick, again, i, noise, step, shared.force_range)
        if read:
            readings.force[axis, i] = told


@helper
def sense_acceleration(
    world: World,
    readings: Readings,
    own: acceleration.Accelerometer,
    e: Errors,
    shared: Shared,
    key: np.uint64,
    again: bool,
    read: bool,
    i: int,
) -> None:
    """Read the acceleration sensor, where the rig has one."""
    tick = int(world.tick[i])
    if shared.share > 0.0:
        for axis in range(2):
            velocity, last = world.motion.velocity[axis, i], own.low_passed[axis, i]
            if not again:
                # Where an episode begins nothing is known of the motion before it: the acceleration is taken for zero.
                change = velocity - (velocity if tick == 0 else own.velocity[axis, i])
                felt = (1.0 + e.acceleration_gain[axis, i]) * (change / shared.period) + e.acceleration_bias[axis, i]
                own.velocity[axis, i] = velocity
                own.low_passed[axis, i] = felt if tick == 0 else last + shared.share * (felt - last)
            if read:
                noise = noise_of(key, tick, acceleration.NOISE + axis, shared.acceleration_noise)
                readings.acceleration[axis, i] = own.low_passed[axis, i] + noise


@helper
def has_sensors(world: World, cylinder: int, i: int) -> float:
    """1 where a cylinder moves, and 0 where it is locked, as the first one of a rail is: it has no sensors that could err.

    What laws read of it all the same is what is there, which does not change.
    """
    return world.rig[at.FREE, i] if cylinder == 0 else 1.0


@helper
def sense_pressures(world: World, readings: Readings, e: Errors, shared: Shared, key: np.uint64, i: int) -> None:
    """Read the pressure cells."""
    tick = int(world.tick[i])
    for chamber in range(4):
        value = pressure_at_cell(world, chamber, i)
        if has_sensors(world, chamber // 2, i) > 0.0:
            noise = noise_of(key, tick, chamber, e.parameters.pressure_noise[i])
            value = converted(value + e.cells[chamber, i] + noise, e.pressure_step[i], 0.0, shared.pressure_range)
        readings.pressure[chamber, i] = value


@helper
def show(seen: Seen, readings: Readings, i: int) -> None:
    """Hand the ``readings`` to the controller."""
    seen.position_time[i] = readings.position_time[i]
    for axis in range(2):
        seen.position[axis, i], seen.velocity[axis, i] = readings.position[axis, i], readings.velocity[axis, i]
        seen.user_force[axis, i], seen.acceleration[axis, i] = readings.force[axis, i], readings.acceleration[axis, i]
    for chamber in range(4):
        seen.pressure[chamber, i] = readings.pressure[chamber, i]


@helper
def seen_again(own: acceleration.Accelerometer, tick: int, i: int) -> bool:
    """Whether this period is looked at once more: where other lanes begin anew, all are."""
    again = tick > 0 and own.tick[i] == tick
    own.tick[i] = tick
    return again


@helper
def is_read(e: Errors, key: np.uint64, tick: int, i: int) -> bool:
    """Whether the board does not miss this period."""
    return tick == 0 or not happens(key, tick, MISSED, e.parameters.missed_periods[i])
