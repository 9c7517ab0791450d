"""Sensors with the errors that data sheets and laboratories know: the sensor model ``honest``.

Figures, their basis and the ranges that are drawn from are fields of ``physics.electronics``. With every error switched off it
is the sensor model ``lab`` to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import (
    ACCELERATION,
    FORCE,
    MOTION,
    OPENING,
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
from birthsim_env.parts.sensors import sensor_errors as at
from birthsim_env.parts.sensors.noise import happens, normal, uniform
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PRESSURES, Array
from birthsim_env.physics.electronics import Electronics

TRACKED, NOISE_OF_FORCE, LOST, MISSED, LATE = 4, 6, 8, 9, 10
"""Channels of random numbers; the pressures have the first four, all as the sensor model ``lab``."""

SHOWN = 13
"""What is shown: x, y and their time, velocity, four pressures, force, acceleration."""


@helper
def _converted(value: float, step: float, least: float, most: float) -> float:
    """``value`` as a converter with a ``step`` tells it; a step of 0 is no converter."""
    return max(least, min(most, step * math.floor(value / step + 0.5))) if step > 0.0 else value


@helper
def _sample(e: Array, c: Array, i: int, axis: int, x: float, y: float, grown: float, chance: float) -> float:
    """One axis of what the tracker tells where it is at (``x``, ``y``); noise ``grown`` by distance, ``chance`` is normal."""
    true = x if axis == 0 else y
    scaled = true + e[at.SCALED, i] * (true - c[at.AT_X + axis])
    distorted = scaled + (at.field(e, i, axis, x, y) - e[at.REGISTERED + axis, i])
    told: float = distorted + e[at.POSITION_NOISE, i] * grown * chance
    return told


@helper
def _growth(e: Array, c: Array, i: int, x: float, y: float) -> float:
    """Factor by which the tracker's noise at (``x``, ``y``) is larger than where it was registered."""
    dx, dy, ax, ay = x - c[at.FROM_X], y - c[at.FROM_Y], c[at.AT_X] - c[at.FROM_X], c[at.AT_Y] - c[at.FROM_Y]
    nearer = (dx * dx + dy * dy) / (ax * ax + ay * ay)
    return exact.exp(0.5 * e[at.GROWTH, i] * exact.log(max(nearer, 1e-12))) if e[at.GROWTH, i] > 0.0 else 1.0


@helper
def _honest(
    ticks: NDArray[Any], time: Array, motion: Array, pressures: Array, force: Array, keys: NDArray[np.uint64], c: Array,
    e: Array, queue: Array, arrived: Array, velocity: Array, passed: Array, late: Array, shown: Array, sensed: Array,
) -> None:  # fmt: skip
    """One control instant. ``c`` constants and ``e`` (ROWS, N) errors of ``sensor_errors``; ``queue``, ``arrived`` and
    ``velocity`` of ``tracker``; ``passed`` (2, N): forces behind the low-pass; ``late`` (Q, 2, N): the last forces converted;
    ``shown`` (SHOWN, N): what is told, which stays as it is in a missed period; ``sensed`` of ``acceleration``."""
    for i in range(time.shape[0]):
        tick, key = int(ticks[i]), keys[i]
        due = tracker.sample_due(tick, time[i], c[at.PERIOD], c[at.RATE])
        if due and (tick == 0 or not happens(key, tick, LOST, e[at.DROPOUT, i])):
            grown = _growth(e, c, i, motion[0, i], motion[1, i])
            x = _sample(e, c, i, 0, motion[0, i], motion[1, i], grown, normal(key, tick, TRACKED))
            y = _sample(e, c, i, 1, motion[0, i], motion[1, i], grown, normal(key, tick, TRACKED + 1))
            tracker.take(queue, i, time[i], c[at.RATE], x, y)
            if tick == 0:
                tracker.start(queue, arrived, velocity, i, x, y, motion[2, i], motion[3, i])
        tracker.arrive(queue, arrived, velocity, i, time[i], e[at.POSITION_LATENCY, i])
        slots = late.shape[0]
        whole = math.floor(e[at.DELAY, i] + 1e-9)
        rest = max(0.0, e[at.DELAY, i] - whole)
        again = acceleration.looked(sensed, i, tick)
        read = tick == 0 or not happens(key, tick, MISSED, e[at.MISSED, i])
        for axis in range(2):
            felt = force[axis, i] + (e[at.GAIN + axis, i] * force[axis, i] + e[at.CROSSTALK + axis, i] * force[1 - axis, i])
            felt += e[at.BIAS + axis, i]
            share = 1.0 if tick == 0 else e[at.PASSED, i]
            if not again:
                passed[axis, i] = passed[axis, i] + share * (felt - passed[axis, i]) if share < 1.0 else felt
            told = passed[axis, i] + e[at.FORCE_NOISE, i] * normal(key, tick, NOISE_OF_FORCE + axis)
            told = _converted(told, e[at.FORCE_STEP, i], -c[at.FORCE_RANGE], c[at.FORCE_RANGE])
            for k in range(slots if tick == 0 else 1):
                late[(tick + k) % slots, axis, i] = told
            if read:
                newer, older = late[(tick - int(whole)) % slots, axis, i], late[(tick - int(whole) - 1) % slots, axis, i]
                shown[9 + axis, i] = newer + rest * (older - newer)
            if c[at.FEELS] > 0.0:
                gain, bias = e[at.ACCELERATION_GAIN + axis, i], e[at.ACCELERATION_BIAS + axis, i]
                told = acceleration.feel(
                    sensed, i, axis, tick, motion[2 + axis, i], gain, bias, c[at.PERIOD], c[at.FEELS], again
                )
                if read:
                    shown[11 + axis, i] = told + c[at.ACCELERATION_NOISE] * normal(key, tick, acceleration.NOISE + axis)
        if read:
            shown[0, i], shown[1, i] = arrived[0, i], arrived[1, i]
            stamp = arrived[2, i] + (e[at.POSITION_LATENCY, i] - c[at.STAMPED])
            shown[2, i] = max(0.0, min(time[i], stamp))
            shown[3, i], shown[4, i] = velocity[0, i], velocity[1, i]
            for chamber in range(4):
                told = pressures[chamber, i] + e[at.CELLS + chamber, i] + e[at.PRESSURE_NOISE, i] * normal(key, tick, chamber)
                shown[5 + chamber, i] = _converted(told, e[at.PRESSURE_STEP, i], 0.0, c[at.PRESSURE_RANGE])


@kernel
def _honest_stage(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    w, s, c = block(world, WORLD), block(seen, SEEN), numbers(constants, at.CONSTANTS)
    keys, mine = table1(tables, 0).view(np.uint64)[lane : lane + n], slice(lane, lane + n)
    shown, pressures = table2(tables, 7)[:, mine], scratch(4)
    for chamber in range(4):
        for i in range(n):
            pressures[chamber, i] = w[STATE + PRESSURES[chamber], i]
    _honest(
        w[TICK, :n], s[TIME, :n], w[MOTION : MOTION + 4, :n], pressures, w[FORCE : FORCE + 2, :n], keys, c,
        table2(tables, 1)[:, mine], table3(tables, 2)[:, :, mine], table2(tables, 3)[:, mine], table2(tables, 4)[:, mine],
        table2(tables, 5)[:, mine], table3(tables, 6)[:, :, mine], shown, table2(tables, 8)[:, mine],
    )  # fmt: skip
    for i in range(n):
        s[POSITION_TIME, i] = shown[2, i]
        for axis in range(2):
            s[POSITION + axis, i], s[VELOCITY + axis, i] = shown[axis, i], shown[3 + axis, i]
            s[USER_FORCE + axis, i], s[ACCELERATION + axis, i] = shown[9 + axis, i], shown[11 + axis, i]
        for chamber in range(4):
            s[PRESSURE + chamber, i] = shown[5 + chamber, i]
    return 0


@helper
def _put_out(ticks: NDArray[Any], keys: NDArray[np.uint64], e: Array, last: Array, openings: Array) -> None:
    """Make ``openings`` (4, N) what the board puts out, which is ``last`` (4, N) in a missed period.

    A clock that jitters is late by a fraction of the period, drawn uniformly. What is put out is then the mean of both openings
    over the period: the spool, with a lag of ``tau``, misses what it would do by at most (T/tau)^2/8 of the change.
    """
    for i in range(ticks.shape[0]):
        tick = int(ticks[i])
        missed = tick > 0 and happens(keys[i], tick, MISSED, e[at.MISSED, i])
        jitters = tick > 0 and e[at.JITTER, i] > 0.0
        late = e[at.JITTER, i] * uniform(keys[i], np.uint64(tick * 32 + 2 * LATE)) if jitters else 0.0
        for valve in range(4):
            told = _converted(openings[valve, i], e[at.OPENING_STEP, i], -1.0, 1.0)
            told = last[valve, i] if missed else told
            openings[valve, i] = told + late * (last[valve, i] - told)
            last[valve, i] = told


@kernel
def _board_stage(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    w, s, mine = block(world, WORLD), block(seen, SEEN), slice(lane, lane + n)
    keys, e, last = table1(tables, 0).view(np.uint64)[mine], table2(tables, 1)[:, mine], table2(tables, 2)[:, mine]
    _put_out(w[TICK, :n], keys, e, last, s[OPENING : OPENING + 4, :n])
    return 0


class HonestSensors:
    """A force sensor, a tracker and pressure cells with the errors of ``Electronics``, read by a board that misses periods.

    The force: gain, crosstalk and bias of the episode, low-pass, noise, converter, latency. The tracker: as ``lab``'s, with
    scale and distortion of the episode about the place of registration, noise that grows with the distance from the
    transmitter, and lost samples; ``position_time`` is worked out with the latency of the rig as described, which is wrong
    where another one is drawn. Pressures: bias of the episode, noise, converter.
    Acceleration, where the rig has such a sensor: gain and bias of the episode, low-pass, noise. In a missed period everything
    that is shown stays as it was, and so do the valves, which are commanded through a converter (``board_stage``).
    """

    sampled = True
    drawn = tuple(f"electronics.{name}" for name in at.FIGURES)

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        self._electronics, self._ranges = electronics, {}  # type: tuple[Electronics, dict[str, tuple[float, float]]]
        # A tracker faster than the control board is read once a period.
        rate = min(electronics.position_rate, 1 / electronics.control_period)
        self._constants = at.shared(electronics, rate)
        self._keys = np.zeros(num_envs, dtype=np.uint64)
        self._errors: Array = np.zeros((at.ROWS, num_envs))
        self._arrived: Array = np.zeros((3, num_envs))
        self._velocity: Array = np.zeros((2, num_envs))
        self._passed: Array = np.zeros((2, num_envs))
        self._shown: Array = np.zeros((SHOWN, num_envs))
        self._last: Array = np.zeros((4, num_envs))
        self._sensed: Array = np.zeros((acceleration.ROWS, num_envs))
        self._make_room()

    def _make_room(self) -> None:
        lanes, board = len(self._keys), self._electronics
        latest = {
            name: max(getattr(board, name), self._ranges.get(name, (0.0, 0.0))[1])
            for name in ("position_latency", "force_latency")
        }
        slots = tracker.slots(self._constants[at.RATE], latest["position_latency"])
        self._queue: Array = np.zeros((slots, 3, lanes))
        self._late: Array = np.zeros((int(latest["force_latency"] / board.control_period + 1e-9) + 2, 2, lanes))

    def vary(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        """From the next episode on draw what ``ranges`` name, as ``"electronics.force_bias"``, uniformly in (low, high)."""
        self._ranges = {name.removeprefix("electronics."): ranges[name] for name in sorted(ranges)}
        self._make_room()

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""
        lanes: NDArray[Any] = np.atleast_1d(lane)
        self._keys[lane] = rng.integers(2**64, dtype=np.uint64)
        unit = np.asarray(rng.uniform(-1.0, 1.0, at.UNIT)).reshape(at.UNIT, -1)
        figures = np.empty((len(at.FIGURES), len(lanes)))
        for row, name in zip(figures, at.FIGURES, strict=True):
            row[:] = getattr(self._electronics, name)
        for name, (low, high) in self._ranges.items():
            figures[at.FIGURES.index(name)] = rng.uniform(low, high)
        errors = np.empty((at.ROWS, len(lanes)))
        at.work_out(figures, unit, self._constants, errors)
        # Drawn last, so that all else is drawn as on a rig without such a sensor.
        most = np.repeat([self._electronics.acceleration_bias, self._electronics.acceleration_gain_error], 2)
        errors[at.ACCELERATION_BIAS :] = most[:, None] * np.asarray(rng.uniform(-1.0, 1.0, 4)).reshape(4, -1)
        self._errors[:, lanes] = errors

    @property
    def figures(self) -> dict[str, Array]:
        """Figure -> what the episode of each lane has, (N,)."""
        return dict(zip(at.FIGURES, self._errors, strict=False))

    @property
    def errors(self) -> Array:
        """Rows of ``sensor_errors`` that the episode of each lane has, (ROWS, N)."""
        return self._errors

    def shift(self, place: Array) -> Array:
        """By how much scale and distortion move what the tracker shows of true places, both (2, N), m."""
        return at.shift(self._errors, self._constants, place)

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement:
        """``motion`` (4, N): x, y, vx, vy of the end effector; ``ticks`` (N,) control periods since the episode began."""
        _honest(
            ticks, time, motion, pressures, force, self._keys, self._constants, self._errors, self._queue, self._arrived,
            self._velocity, self._passed, self._late, self._shown, self._sensed,
        )  # fmt: skip
        told = self._shown.copy()
        felt = told[11:] if self._constants[at.FEELS] > 0.0 else None
        return Measurement(time, told[:2], told[2], told[3:5], told[5:9], told[9:11], True, felt)

    def stage(self) -> Stage:
        """``measure``, compiled into the closed loop."""
        keys = self._keys.view(np.float64)
        tables = (
            keys, self._errors, self._queue, self._arrived, self._velocity, self._passed, self._late, self._shown, self._sensed,
        )  # fmt: skip
        return Stage(_honest_stage, self._constants, tables=tables)

    def put_out(self, ticks: NDArray[np.int64], openings: Array) -> Array:
        """What reaches the valves of ``openings`` (4, N): converted, late by the clock's jitter, and not at all in a missed
        period."""
        out = np.array(openings, dtype=np.float64)
        _put_out(ticks, self._keys, self._errors, self._last, out)
        return out

    def board_stage(self) -> Stage:
        """``put_out``, compiled into the closed loop."""
        return Stage(_board_stage, tables=(self._keys.view(np.float64), self._errors, self._last))
