"""The sensor model ``encoders``: positions of both pistons, counted at the rods.

The board works out where the end effector is by the linkage's kinematics. Where the structure bends it is where the linkage
ends; a tracker at the head would see the handle.
"""

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage, table1, table2, table3
from birthsim_env.parts.sensors import acceleration, tracker
from birthsim_env.parts.sensors.joint_board import (
    ENCODER_PARAMETERS,
    TRACKER_PARAMETERS,
    JointBoard,
    JointErrors,
    JointShared,
    drawn_without,
)
from birthsim_env.parts.sensors.noise import noise_of
from birthsim_env.parts.sensors.readings import (
    Readings,
    converted,
    has_sensors,
    is_read,
    seen_again,
    sense_acceleration,
    sense_force,
    sense_pressures,
    show,
)
from birthsim_env.parts.sensors.sensor_errors import Errors
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from birthsim_env.registry import register

COUNTED = 13
"""First of the two channels of random numbers, in all sensor models."""

RATE_TIME = 0.005
"""s; assumed: time constant of the low-pass on an encoder's position differences, which stand for the velocity."""

FARTHEST = 100.0
"""m that an encoder counts."""


@helper
def count(
    world: World,
    time: float,
    shared: JointShared,
    e: JointErrors,
    queue: Array,
    arrived: tracker.Arrived,
    key: np.uint64,
    i: int,
) -> None:
    """Take a sample of both pistons where it is due, and let arrive what is under way in the ``queue`` (Q, 3, N)."""
    tick = int(world.tick[i])
    if tracker.sample_due(tick, time, shared.period, shared.encoder_rate):
        step, noise = e.parameters.encoder_resolution[i], e.parameters.encoder_noise[i]
        place1 = world.state[at.Y1, i] + e.offset[0, i] + noise_of(key, tick, COUNTED, noise)
        place2 = world.state[at.Y2, i] + e.offset[1, i] + noise_of(key, tick, COUNTED + 1, noise)
        y1, y2 = converted(place1, step, -FARTHEST, FARTHEST), converted(place2, step, -FARTHEST, FARTHEST)
        y1 *= has_sensors(world, 0, i)  # it is locked at 0
        tracker.take(queue, i, time, shared.encoder_rate, y1, y2)
        if tick == 0:
            tracker.start(queue, arrived, i, y1, y2, world.state[at.V1, i], world.state[at.V2, i])
    tracker.arrive(queue, arrived, i, time, e.parameters.encoder_latency[i], RATE_TIME)


@helper
def read_encoders(
    world: World, seen: Seen, readings: Readings, arrived: tracker.Arrived, e: JointErrors, shared: JointShared, i: int
) -> None:
    """Work out the end effector's motion from what has arrived of the encoders'."""
    p = world.rig
    stamp = arrived.time[i] + (e.parameters.encoder_latency[i] - shared.encoder_stamped)
    readings.position_time[i] = max(0.0, min(seen.time[i], stamp))
    _, r2, _, _, _, kappa, sine, cosine = geometry.pose(
        arrived.position[0, i], arrived.position[1, i], p[at.K1, i], p[at.K2, i], p[at.D_SQUARES, i], p[at.D_PRODUCT, i],
        p[at.SIN_GAMMA3, i], p[at.COS_GAMMA3, i],
    )  # fmt: skip
    v1, v2 = arrived.velocity[0, i], arrived.velocity[1, i]
    readings.position[0, i], readings.position[1, i] = r2 * sine, -r2 * cosine
    readings.velocity[0, i], readings.velocity[1, i] = -kappa * cosine * v1 + sine * v2, -kappa * sine * v1 - cosine * v2


@kernel
def _look(world: World, seen: Seen, memory: int, shared: JointShared, tables: int, lane: int, n: int) -> int:
    """One control instant."""
    mine = slice(lane, lane + n)
    keys, e, queue = table1(tables, 0).view(np.uint64)[mine], Errors(table2(tables, 1)[:, mine]), table3(tables, 2)[:, :, mine]
    arrived, own = tracker.Arrived(table2(tables, 3)[:, mine]), acceleration.Accelerometer(table2(tables, 7)[:, mine])
    passed, late, readings = table2(tables, 4)[:, mine], table3(tables, 5)[:, :, mine], Readings(table2(tables, 6)[:, mine])
    joint = JointErrors(table2(tables, 8)[:, mine])
    for i in range(n):
        tick, key = int(world.tick[i]), keys[i]
        count(world, seen.time[i], shared, joint, queue, arrived, key, i)
        again, read = seen_again(own, tick, i), is_read(e, key, tick, i)
        sense_force(world, readings, passed, late, e, shared, key, again, read, i)
        sense_acceleration(world, readings, own, e, shared, key, again, read, i)
        if read:
            read_encoders(world, seen, readings, arrived, joint, shared, i)
            sense_pressures(world, readings, e, shared, key, i)
        show(seen, readings, i)
    return 0


class CountingBoard(JointBoard):
    """A board whose positions are those of encoders."""

    counted = True

    def _position_clock(self) -> tuple[float, float]:
        board = self._electronics
        return min(board.encoder_rate, 1 / board.control_period), self._latest("encoder_latency")


@register(
    sensors="encoders", about="As honest, with encoders at both rods in place of the tracker; the force sensor is at the head.",
    order=4,
)  # fmt: skip
class EncoderSensors(CountingBoard):
    """Encoders, pressure cells and a force sensor at the head, with the errors of ``honest`` sensors otherwise.

    An encoder has an offset of the episode, noise, counts, a rate and a latency. Positions and speeds of the end effector
    follow from the linkage's kinematics, so that the piston positions that a controller works out of them are those that
    were counted.
    """

    drawn = drawn_without(*TRACKER_PARAMETERS, also=ENCODER_PARAMETERS)

    def stage(self) -> Stage:
        return Stage(_look, self._joint_shared, tables=self._tables)
