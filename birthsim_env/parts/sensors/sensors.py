"""The three sensor models.

``ideal`` sees everything at every control period. ``lab`` is a magnetic tracker and pressure cells with noise and latency.
``honest`` also has the errors that data sheets state: of a force sensor, a tracker, pressure cells and a control board.

A sensor model's ``measure`` is called whenever somebody looks: at every control period where ``sampled`` is True, else at
every policy period.
"""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Seen, Signals, World, measurement_of
from birthsim_env.loop.signals import Measurement
from birthsim_env.loop.stage import Stage, table1, table2, table3
from birthsim_env.parts.drawn.seeding import vectorised
from birthsim_env.parts.sensors import acceleration, tracker
from birthsim_env.parts.sensors.honest_sensors import HonestSensors
from birthsim_env.parts.sensors.looking import looked_at
from birthsim_env.parts.sensors.noise import normal
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PRESSURES, Array
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.physics.electronics import Electronics


@kernel
def ideal_stage(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Shows position, velocity, pressures and the hand's force as they are."""
    place, speed = world.motion.position, world.motion.velocity
    for i in range(n):
        seen.position_time[i] = seen.time[i]
        for axis in range(2):
            seen.position[axis, i], seen.velocity[axis, i] = place[axis, i], speed[axis, i]
            seen.user_force[axis, i] = world.force[axis, i]
        for chamber in range(4):
            seen.pressure[chamber, i] = world.state[PRESSURES[chamber], i]
    return 0


class IdealSensors:
    """Position, velocity, pressures and the user's force, exact and at once."""

    sampled = False

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        pass

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement:
        """``motion`` (4, N): x, y, vx, vy of the end effector; ``ticks`` (N,) control periods since the episode began."""
        return Measurement(time, motion[:2], time, motion[2:], pressures, force, sampled=False)

    def stage(self) -> Stage:
        """``measure``, compiled into the closed loop."""
        return Stage(ideal_stage)


class Board(Numbers):
    """What all lanes share."""

    period = number("s", "control period")
    rate = number("Hz", "of the tracker")
    latency = number("s", "of the tracker")
    position_noise = number("m", "of the tracker")
    pressure_noise = number("Pa", "of a pressure cell")
    share = number("1", "what passes the low-pass of an acceleration sensor in a period; 0: there is none")
    acceleration_noise = number("m/s2", "of that sensor")


class Kept(NamedTuple):
    """What the sensors remember of N lanes; ``queue`` (Q, 3, N) are samples on their way."""

    keys: NDArray[np.uint64]
    queue: Array
    arrived: tracker.Arrived
    accelerometer: acceleration.Accelerometer


@helper
def _lab(world: World, seen: Signals, board: Board, kept: Kept, n: int) -> None:
    """One control instant."""
    arrived, place, speed = kept.arrived, world.motion.position, world.motion.velocity
    for i in range(n):
        tick, key, time = int(world.tick[i]), kept.keys[i], seen.time[i]
        if tracker.sample_due(tick, time, board.period, board.rate):
            x = place[0, i] + board.position_noise * normal(key, tick, 4)
            y = place[1, i] + board.position_noise * normal(key, tick, 5)
            tracker.take(kept.queue, i, time, board.rate, x, y)
            if tick == 0:
                tracker.start(kept.queue, arrived, i, x, y, speed[0, i], speed[1, i])
        tracker.arrive(kept.queue, arrived, i, time, board.latency)
        seen.position_time[i] = arrived.time[i]
        for chamber in range(4):
            seen.pressure[chamber, i] = world.state[PRESSURES[chamber], i] + board.pressure_noise * normal(key, tick, chamber)
        again = acceleration.looked(kept.accelerometer, i, tick)
        for axis in range(2):
            seen.position[axis, i], seen.velocity[axis, i] = arrived.position[axis, i], arrived.velocity[axis, i]
            seen.user_force[axis, i], seen.acceleration[axis, i] = world.force[axis, i], 0.0
            if board.share > 0.0:
                sensed = acceleration.feel(
                    kept.accelerometer, i, axis, tick, speed[axis, i], 0.0, 0.0, board.period, board.share, again
                )
                noise = board.acceleration_noise * normal(key, tick, acceleration.NOISE + axis)
                seen.acceleration[axis, i] = sensed + noise


@kernel
def _lab_stage(world: World, seen: Seen, memory: int, board: Board, tables: int, lane: int, n: int) -> int:
    mine = slice(lane, lane + n)
    kept = Kept(
        table1(tables, 0).view(np.uint64)[mine], table3(tables, 1)[:, :, mine], tracker.Arrived(table2(tables, 2)[:, mine]),
        acceleration.Accelerometer(table2(tables, 3)[:, mine]),
    )  # fmt: skip
    _lab(world, seen, board, kept, n)
    return 0


class LabSensors:
    """A tracker with a rate of its own, noise and latency; noisy pressure cells read at every control period, and so is an
    acceleration sensor where the rig has one.

    No velocity is measured: in its place stands the low-passed difference of samples. The user's force is that of an ideal
    force sensor.
    """

    sampled = True

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        board = electronics
        # A tracker faster than the control board is read once a period; the queue's slots count samples, one a period at most.
        rate = min(board.position_rate, 1 / board.control_period)
        self._board = Board.numbers(
            period=board.control_period, rate=rate, latency=board.position_latency, position_noise=board.position_noise,
            pressure_noise=board.pressure_noise, acceleration_noise=board.acceleration_noise,
            share=acceleration.passed(board.acceleration_bandwidth, board.control_period),
        )  # fmt: skip
        self._queue: Array = np.zeros((tracker.slots(rate, board.position_latency), tracker.Sample.size, num_envs))
        self._arrived: Array = np.zeros((tracker.Arrived.size, num_envs))
        self._keys = np.zeros(num_envs, dtype=np.uint64)
        self._accelerometer: Array = np.zeros((acceleration.Accelerometer.size, num_envs))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""
        self._keys[lane] = rng.integers(2**64, dtype=np.uint64)

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement:
        """``motion`` (4, N): x, y, vx, vy of the end effector; ``ticks`` (N,) control periods since the episode began."""
        (world, seen), board = looked_at(ticks, time, motion, pressures, force), Board(self._board)
        kept = Kept(self._keys, self._queue, tracker.Arrived(self._arrived), acceleration.Accelerometer(self._accelerometer))
        _lab(world, seen, board, kept, len(time))
        return measurement_of(seen.rows, True, board.share > 0.0)

    def stage(self) -> Stage:
        """``measure``, compiled into the closed loop."""
        keys = self._keys.view(np.float64)
        return Stage(_lab_stage, self._board, tables=(keys, self._queue, self._arrived, self._accelerometer))


class SensorModel(Protocol):
    """What measures; ``sampled`` is True where it must look at every control instant."""

    sampled: bool

    def __init__(self, electronics: Electronics, num_envs: int) -> None: ...

    def begin(self, lane: int, rng: np.random.Generator) -> None: ...

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement: ...


def put_out(sensors: SensorModel, ticks: NDArray[np.int64], openings: Array) -> Array:
    """What reaches the valves of ``openings`` (4, N) behind the sensors' control board, where they have one."""
    board = getattr(sensors, "put_out", None)
    return openings if board is None else np.asarray(board(ticks, openings))


SENSORS: dict[str, type[SensorModel]] = {"ideal": IdealSensors, "lab": LabSensors, "honest": HonestSensors}
"""A model that has ``drawn``, names of parameters, and ``vary(ranges)`` draws these for every episode where rigs are drawn;
one that has ``put_out(ticks, openings)`` and ``board_stage()`` stands between a controller's openings and the valves too."""


def drawn_by(sensors: str) -> tuple[str, ...]:
    """Dotted names of the parameters that the sensor model ``sensors`` can draw for every episode."""
    return getattr(SENSORS[sensors], "drawn", ())
