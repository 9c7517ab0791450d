"""The sensor models with rod gauges: the hand's force from what each rod carries.

A gauge between piston and linkage feels the mean force of the control period that has just ended, by the balance of momentum

    F rods = d(m v)/dt - F hand - m g,   along the rods J^T F rods (17)

It does not feel the friction of the piston behind it, but all of the weight, and the head's inertia. The board takes off the
weight, which the gauges themselves have weighed, and, with an acceleration sensor, the inertia; without one a moving head
counts m a as a hand's force.
"""

import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage, table1, table2, table3
from birthsim_env.parts.sensors import acceleration, tracker
from birthsim_env.parts.sensors.board import read_tracker, track
from birthsim_env.parts.sensors.encoders import CountingBoard, count, read_encoders
from birthsim_env.parts.sensors.joint_board import (
    ENCODER_PARAMETERS,
    FORCE_PARAMETERS,
    GAUGE_PARAMETERS,
    TRACKER_PARAMETERS,
    JointBoard,
    JointErrors,
    JointShared,
    drawn_without,
)
from birthsim_env.parts.sensors.readings import (
    Readings,
    has_sensors,
    is_read,
    late_force,
    seen_again,
    sense_acceleration,
    sense_pressures,
    show,
)
from birthsim_env.parts.sensors.sensor_errors import Errors
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.electronics import Electronics
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.registry import register

NEEDS = {"acceleration sensor"}
"""What gauges cannot do without: it takes off what moves the head."""


class Rods(Rows):
    """What the gauges remember of the last period."""

    velocity = rows("x y", "m/s", "of the centre of the moving mass")
    force = rows("x y", "N", "of the hand")


@helper
def mass_velocity(world: World, axis: int, end: float, i: int) -> float:
    """Velocity of the centre of the moving mass, m/s; ``end`` is that of the linkage's end, which a handle may swing about."""
    share = world.rig[at.HANDLE, i] if world.rig[at.MODE_RATE, i] > 0.0 else 0.0
    velocity: float = end + share * (world.motion.velocity[axis, i] - end)
    return velocity


@helper
def sense_rods(
    world: World,
    readings: Readings,
    rods: Rods,
    passed: Array,
    late: Array,
    e: Errors,
    joint: JointErrors,
    shared: JointShared,
    key: np.uint64,
    again: bool,
    read: bool,
    i: int,
) -> None:
    """Read both gauges, and work out the hand's force with the pose and the acceleration of the ``readings``."""
    tick, p, mass = int(world.tick[i]), world.rig, world.rig[at.MASS, i]
    _, _, _, _, _, kappa, sine, cosine = geometry.pose(
        world.state[at.Y1, i], world.state[at.Y2, i], p[at.K1, i], p[at.K2, i], p[at.D_SQUARES, i], p[at.D_PRODUCT, i],
        p[at.SIN_GAMMA3, i], p[at.COS_GAMMA3, i],
    )  # fmt: skip
    v1, v2 = world.state[at.V1, i], world.state[at.V2, i]
    vx = mass_velocity(world, 0, -kappa * cosine * v1 + sine * v2, i)
    vy = mass_velocity(world, 1, -kappa * sine * v1 - cosine * v2, i)
    # Where an episode begins nothing is known of the motion before it: the acceleration is taken for zero.
    ax = 0.0 if tick == 0 else (vx - rods.velocity[0, i]) / shared.period
    ay = 0.0 if tick == 0 else (vy - rods.velocity[1, i]) / shared.period
    hand_x = world.force[0, i] if tick == 0 else rods.force[0, i]
    hand_y = world.force[1, i] if tick == 0 else rods.force[1, i]
    carried_x, carried_y = mass * ax - hand_x, mass * (ay + p[at.GRAVITY, i]) - hand_y
    noise, step = joint.parameters.gauge_noise[i], e.force_step[i] * (shared.gauge_range / shared.force_range)
    rod1, rod2 = mechanics.user_force1(carried_x, carried_y, kappa, sine, cosine), sine * carried_x - cosine * carried_y
    sensed2, full, errs = rod2 + joint.gain[1, i] * rod2 + joint.bias[1, i], shared.gauge_range, has_sensors(world, 0, i)
    sensed1 = rod1 + joint.gain[0, i] * rod1 * errs + joint.bias[0, i] * errs
    told1 = late_force(sensed1, 0, passed, late, e, shared, key, tick, again, i, noise * errs, step * errs, full)
    told2 = late_force(sensed2, 1, passed, late, e, shared, key, tick, again, i, noise, step, full)
    if not again:
        rods.velocity[0, i], rods.velocity[1, i] = vx, vy
        rods.force[0, i], rods.force[1, i] = world.force[0, i], world.force[1, i]
    if read:
        x, y = readings.position[0, i], readings.position[1, i]
        r2 = math.sqrt(x * x + y * y)
        sin_seen, cos_seen = x / r2, -y / r2
        sin_gamma3, cos_gamma3, product = p[at.SIN_GAMMA3, i], p[at.COS_GAMMA3, i], p[at.D_PRODUCT, i]
        r4 = geometry.length_r4(sin_seen, cos_seen, p[at.D_SQUARES, i], product, sin_gamma3, cos_gamma3)
        root = product * (cos_gamma3 * cos_seen + sin_gamma3 * sin_seen)
        across = -told1 / geometry.amplification(r2, r4, 1.0 / root)
        rods_x, rods_y = cos_seen * across + sin_seen * told2, sin_seen * across - cos_seen * told2
        readings.force[0, i] = mass * readings.acceleration[0, i] - rods_x
        readings.force[1, i] = mass * (readings.acceleration[1, i] + p[at.GRAVITY, i]) - rods_y


@kernel
def _look(world: World, seen: Seen, memory: int, shared: JointShared, tables: int, lane: int, n: int) -> int:
    """One control instant."""
    mine = slice(lane, lane + n)
    keys, e, queue = table1(tables, 0).view(np.uint64)[mine], Errors(table2(tables, 1)[:, mine]), table3(tables, 2)[:, :, mine]
    arrived, own = tracker.Arrived(table2(tables, 3)[:, mine]), acceleration.Accelerometer(table2(tables, 7)[:, mine])
    passed, late, readings = table2(tables, 4)[:, mine], table3(tables, 5)[:, :, mine], Readings(table2(tables, 6)[:, mine])
    joint, rods, counted = JointErrors(table2(tables, 8)[:, mine]), Rods(table2(tables, 9)[:, mine]), shared.counted > 0.0
    for i in range(n):
        tick, key = int(world.tick[i]), keys[i]
        if counted:
            count(world, seen.time[i], shared, joint, queue, arrived, key, i)
        else:
            track(world, seen.time[i], shared, e, queue, arrived, key, i)
        again, read = seen_again(own, tick, i), is_read(e, key, tick, i)
        sense_acceleration(world, readings, own, e, shared, key, again, read, i)
        if read:
            if counted:
                read_encoders(world, seen, readings, arrived, joint, shared, i)
            else:
                read_tracker(seen, readings, arrived, e, shared, i)
            sense_pressures(world, readings, e, shared, key, i)
        sense_rods(world, readings, rods, passed, late, e, joint, shared, key, again, read, i)
        show(seen, readings, i)
    return 0


class GaugingBoard(JointBoard):
    """A board that works out the hand's force from rod gauges."""

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        if electronics.acceleration_bandwidth == 0.0:
            warnings.warn(
                "rod gauges with electronics.acceleration_bandwidth = 0: without an acceleration sensor the inertia of a "
                "moving head counts as a hand's force, and controllers that trust it make the head shake; give the rig one, "
                "such as 300 Hz",
                stacklevel=2,
            )
        super().__init__(electronics, num_envs)
        self._rods: Array = np.zeros((Rods.size, num_envs))

    @property
    def _tables(self) -> tuple[NDArray[Any], ...]:
        return (*super()._tables, self._rods)

    def stage(self) -> Stage:
        return Stage(_look, self._joint_shared, tables=self._tables)


@register(
    sensors="encoders-gauges",
    about="As encoders, with gauges in both rods in place of the force sensor; the rig needs an acceleration sensor.",
    needs=NEEDS,
    order=5,
)
class EncoderGaugeSensors(GaugingBoard, CountingBoard):
    """Encoders and gauges at both rods, and pressure cells: nothing is at the head."""

    drawn = drawn_without(*TRACKER_PARAMETERS, *FORCE_PARAMETERS, also=(*ENCODER_PARAMETERS, *GAUGE_PARAMETERS))


@register(
    sensors="tracker-gauges",
    about="As honest, with gauges in both rods in place of the force sensor; the rig needs an acceleration sensor.",
    needs=NEEDS,
    order=6,
)
class TrackerGaugeSensors(GaugingBoard):
    """A tracker at the head, gauges at both rods, and pressure cells."""

    drawn = drawn_without(*FORCE_PARAMETERS, also=GAUGE_PARAMETERS)
