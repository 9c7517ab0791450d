"""The three sensor models.

``ideal`` sees everything at every control period. ``lab`` is a magnetic tracker and pressure cells with noise and latency.
``honest`` also has the errors that data sheets state: of a force sensor, a tracker, pressure cells and a control board.

A sensor model's ``measure`` is called whenever somebody looks: at every control period where ``sampled`` is True, else at
every policy period.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import (
    ACCELERATION,
    FORCE,
    MOTION,
    POSITION,
    POSITION_TIME,
    PRESSURE,
    SEEN,
    STATE,
    TICK,
    TIME,
    USER_FORCE,
    VELOCITY,
    WORLD,
)
from birthsim_env.loop.signals import Measurement
from birthsim_env.loop.stage import Stage, block, numbers, scratch, table1, table2, table3
from birthsim_env.parts.drawn.seeding import vectorised
from birthsim_env.parts.sensors import acceleration, tracker
from birthsim_env.parts.sensors.honest_sensors import HonestSensors
from birthsim_env.parts.sensors.noise import normal
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PRESSURES, Array
from birthsim_env.physics.electronics import Electronics


@kernel
def ideal_stage(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Shows position, velocity, pressures and the hand's force as they are."""
    w, s = block(world, WORLD), block(seen, SEEN)
    for i in range(n):
        s[POSITION_TIME, i] = s[TIME, i]
        for axis in range(2):
            s[POSITION + axis, i], s[VELOCITY + axis, i] = w[MOTION + axis, i], w[MOTION + 2 + axis, i]
            s[USER_FORCE + axis, i] = w[FORCE + axis, i]
        for chamber in range(4):
            s[PRESSURE + chamber, i] = w[STATE + PRESSURES[chamber], i]
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


@helper
def _lab(
    ticks: NDArray[Any], time: Array, motion: Array, pressures: Array, keys: NDArray[np.uint64], period: float,
    rate: float, latency: float, position_noise: float, pressure_noise: float, passed: float, acceleration_noise: float,
    queue: Array, shown: Array, velocity: Array, sensed: Array, seen: Array,
) -> None:  # fmt: skip
    """One control instant; ``queue``, ``shown`` and ``velocity`` as in ``parts.tracker``, ``sensed`` in
    ``parts.acceleration``, ``seen`` (6, N): noisy pressures and acceleration."""
    for i in range(time.shape[0]):
        tick, key = int(ticks[i]), keys[i]
        if tracker.sample_due(tick, time[i], period, rate):
            x = motion[0, i] + position_noise * normal(key, tick, 4)
            y = motion[1, i] + position_noise * normal(key, tick, 5)
            tracker.take(queue, i, time[i], rate, x, y)
            if tick == 0:
                tracker.start(queue, shown, velocity, i, x, y, motion[2, i], motion[3, i])
        tracker.arrive(queue, shown, velocity, i, time[i], latency)
        for chamber in range(4):
            seen[chamber, i] = pressures[chamber, i] + pressure_noise * normal(key, tick, chamber)
        again = acceleration.looked(sensed, i, tick)
        for axis in range(2):
            seen[4 + axis, i] = 0.0
            if passed > 0.0:
                told = acceleration.feel(sensed, i, axis, tick, motion[2 + axis, i], 0.0, 0.0, period, passed, again)
                seen[4 + axis, i] = told + acceleration_noise * normal(key, tick, acceleration.NOISE + axis)


@kernel
def _lab_stage(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    w, s, about = block(world, WORLD), block(seen, SEEN), numbers(constants, 7)
    keys, mine = table1(tables, 0).view(np.uint64)[lane : lane + n], slice(lane, lane + n)
    queue, shown, velocity = table3(tables, 1)[:, :, mine], table2(tables, 2)[:, mine], table2(tables, 3)[:, mine]
    pressures, told = scratch(4), scratch(6)
    for chamber in range(4):
        for i in range(n):
            pressures[chamber, i] = w[STATE + PRESSURES[chamber], i]
    _lab(
        w[TICK, :n], s[TIME, :n], w[MOTION : MOTION + 4, :n], pressures, keys, about[0], about[1], about[2], about[3], about[4],
        about[5], about[6], queue, shown, velocity, table2(tables, 4)[:, mine], told,
    )  # fmt: skip
    for i in range(n):
        s[POSITION_TIME, i] = shown[2, i]
        for axis in range(2):
            s[POSITION + axis, i], s[VELOCITY + axis, i] = shown[axis, i], velocity[axis, i]
            s[USER_FORCE + axis, i], s[ACCELERATION + axis, i] = w[FORCE + axis, i], told[4 + axis, i]
        for chamber in range(4):
            s[PRESSURE + chamber, i] = told[chamber, i]
    return 0


class LabSensors:
    """A tracker with a rate of its own, noise and latency; noisy pressure cells read at every control period, and so is an
    acceleration sensor where the rig has one.

    No velocity is measured: what is shown is the low-passed difference of samples. The user's force is that of an ideal
    force sensor.
    """

    sampled = True

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        board = electronics
        # A tracker faster than the control board is read once a period; the queue's slots count samples, one a period at most.
        rate = min(board.position_rate, 1 / board.control_period)
        self._numbers = (
            board.control_period, rate, board.position_latency, board.position_noise, board.pressure_noise,
            acceleration.passed(board.acceleration_bandwidth, board.control_period), board.acceleration_noise,
        )  # fmt: skip
        self._queue: Array = np.zeros((tracker.slots(rate, board.position_latency), 3, num_envs))
        self._shown: Array = np.zeros((3, num_envs))
        self._keys = np.zeros(num_envs, dtype=np.uint64)
        self._velocity: Array = np.zeros((2, num_envs))
        self._sensed: Array = np.zeros((acceleration.ROWS, num_envs))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""
        self._keys[lane] = rng.integers(2**64, dtype=np.uint64)

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement:
        """``motion`` (4, N): x, y, vx, vy of the end effector; ``ticks`` (N,) control periods since the episode began."""
        seen, kept = np.empty((6, len(time))), (self._queue, self._shown, self._velocity, self._sensed)
        _lab(ticks, time, motion, pressures, self._keys, *self._numbers, *kept, seen)
        shown = self._shown.copy()
        felt = seen[4:] if self._numbers[5] > 0.0 else None
        return Measurement(time, shown[:2], shown[2], self._velocity.copy(), seen[:4], force, True, felt)

    def stage(self) -> Stage:
        """``measure``, compiled into the closed loop."""
        keys = self._keys.view(np.float64)
        return Stage(_lab_stage, np.array(self._numbers), tables=(keys, self._queue, self._shown, self._velocity, self._sensed))


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
