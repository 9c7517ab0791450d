"""What a control board reads of a force sensor, a tracker, pressure cells and an accelerometer, each with its errors.

The sensor models ``lab`` and ``honest`` are such boards. Parameters, their sources and the ranges that are drawn from are
declared in ``physics.electronics``.
"""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage, table1, table2, table3
from birthsim_env.parts.drawn.seeding import vectorised
from birthsim_env.parts.sensors import acceleration, tracker
from birthsim_env.parts.sensors.model import SensorModel
from birthsim_env.parts.sensors.noise import happens, noise_of
from birthsim_env.parts.sensors.readings import (
    Readings,
    is_read,
    seen_again,
    sense_acceleration,
    sense_force,
    sense_pressures,
    show,
)
from birthsim_env.parts.sensors.sensor_errors import (
    SENSOR_PARAMETERS,
    Errors,
    SensorParameters,
    Shared,
    Unit,
    field,
    shared,
    work_out,
)
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel, over
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.electronics import Electronics
from birthsim_env.restored import Declared, Kept

TRACKED, LOST = 4, 8
"""Channels of random numbers; ``readings`` has those of forces and of missed periods."""


@helper
def _sample(e: Errors, shared: Shared, i: int, axis: int, x: float, y: float, noise: float) -> float:
    """What the tracker measures along one axis where it is at (``x``, ``y``), with a ``noise`` in m."""
    true = x if axis == 0 else y
    scaled = true + e.scaled[i] * (true - shared.registration[axis])
    measured: float = scaled + (field(e, i, axis, x, y) - e.registered[axis, i] if e.height[i] > 0.0 else 0.0) + noise
    return measured


@helper
def _growth(e: Errors, shared: Shared, i: int, x: float, y: float) -> float:
    """Factor by which the tracker's noise at (``x``, ``y``) is larger than where it was registered."""
    place, origin, power = shared.registration, shared.transmitter, e.parameters.position_noise_growth[i]
    dx, dy, ax, ay = x - origin[0], y - origin[1], place[0] - origin[0], place[1] - origin[1]
    nearer = (dx * dx + dy * dy) / (ax * ax + ay * ay)
    return exact.exp(0.5 * power * exact.log(max(nearer, 1e-12))) if power > 0.0 else 1.0


@helper
def track(
    world: World, time: float, shared: Shared, e: Errors, queue: Array, arrived: tracker.Arrived, key: np.uint64, i: int
) -> None:
    """Take a sample where it is due, and let arrive what is under way in the ``queue`` (Q, 3, N)."""
    tick = int(world.tick[i])
    due = tracker.sample_due(tick, time, shared.period, shared.rate)
    if due and (tick == 0 or not happens(key, tick, LOST, e.parameters.position_dropout[i])):
        x, y = world.motion.position[0, i], world.motion.position[1, i]
        noise = e.parameters.position_noise[i] * _growth(e, shared, i, x, y)
        at_x = _sample(e, shared, i, 0, x, y, noise_of(key, tick, TRACKED, noise))
        at_y = _sample(e, shared, i, 1, x, y, noise_of(key, tick, TRACKED + 1, noise))
        tracker.take(queue, i, time, shared.rate, at_x, at_y)
        if tick == 0:
            speed = world.motion.velocity
            tracker.start(queue, arrived, i, at_x, at_y, speed[0, i], speed[1, i])
    tracker.arrive(queue, arrived, i, time, e.parameters.position_latency[i], tracker.RATE_TIME)


@helper
def read_tracker(seen: Seen, readings: Readings, arrived: tracker.Arrived, e: Errors, shared: Shared, i: int) -> None:
    """Take over what has arrived of the tracker's."""
    stamp = arrived.time[i] + (e.parameters.position_latency[i] - shared.stamped)
    readings.position_time[i] = max(0.0, min(seen.time[i], stamp))
    for axis in range(2):
        readings.position[axis, i], readings.velocity[axis, i] = arrived.position[axis, i], arrived.velocity[axis, i]


@kernel
def _look(world: World, seen: Seen, memory: int, shared: Shared, tables: int, lane: int, n: int) -> int:
    """One control instant."""
    mine = slice(lane, lane + n)
    keys, e, queue = table1(tables, 0).view(np.uint64)[mine], Errors(table2(tables, 1)[:, mine]), table3(tables, 2)[:, :, mine]
    arrived, own = tracker.Arrived(table2(tables, 3)[:, mine]), acceleration.Accelerometer(table2(tables, 7)[:, mine])
    passed, late, readings = table2(tables, 4)[:, mine], table3(tables, 5)[:, :, mine], Readings(table2(tables, 6)[:, mine])
    for i in range(n):
        tick, key = int(world.tick[i]), keys[i]
        track(world, seen.time[i], shared, e, queue, arrived, key, i)
        again, read = seen_again(own, tick, i), is_read(e, key, tick, i)
        sense_force(world, readings, passed, late, e, shared, key, again, read, i)
        sense_acceleration(world, readings, own, e, shared, key, again, read, i)
        if read:
            read_tracker(seen, readings, arrived, e, shared, i)
            sense_pressures(world, readings, e, shared, key, i)
        show(seen, readings, i)
    return 0


class BoardSensors(SensorModel):
    """A force sensor, a tracker and pressure cells with the errors of ``Electronics``, read by a board that misses periods.

    The force: gain, crosstalk and bias of the episode, low-pass, noise, converter, latency. The tracker has a rate of its own,
    noise and latency, scale and distortion of the episode about the place of registration, noise that grows with the distance
    from the transmitter, and lost samples. No velocity is measured: in its place stands the low-passed difference of samples.
    ``position_time`` is worked out with the latency of the rig as described, which is wrong where another one is drawn.
    Pressures: bias of the episode, noise, converter. Acceleration, where the rig has such a sensor: gain and bias of the
    episode, low-pass, noise. In a missed period everything that they say stays as it was.
    """

    sampled = True
    in_state: ClassVar[Declared] = {"_keys": Kept(least=0, most=2**64 - 1, whole=True)}

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        self._electronics, self._ranges = electronics, {}  # type: tuple[Electronics, dict[str, tuple[float, float]]]
        # A tracker faster than the control board is read once a period.
        self._shared = shared(electronics, min(electronics.position_rate, 1 / electronics.control_period))
        self._keys = np.zeros(num_envs, dtype=np.uint64)
        self._errors: Array = np.zeros((Errors.size, num_envs))
        self._arrived: Array = np.zeros((tracker.Arrived.size, num_envs))
        self._passed: Array = np.zeros((2, num_envs))
        self._readings: Array = np.zeros((Readings.size, num_envs))
        self._accelerometer: Array = np.zeros((acceleration.Accelerometer.size, num_envs))
        self._make_room()

    def _make_room(self) -> None:
        lanes, board = len(self._keys), self._electronics
        slots = tracker.slots(*self._position_clock())
        self._queue: Array = np.zeros((slots, 3, lanes))
        self._late: Array = np.zeros((int(self._latest("force_latency") / board.control_period + 1e-9) + 2, 2, lanes))

    def _latest(self, name: str) -> float:
        """The largest that a latency of the board can be, s."""
        return max(float(getattr(self._electronics, name)), self._ranges.get(name, (0.0, 0.0))[1])

    def _position_clock(self) -> tuple[float, float]:
        """Samples per second of what measures positions, and its largest latency, s."""
        return Shared(self._shared).rate, self._latest("position_latency")

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""
        lanes: NDArray[Any] = np.atleast_1d(lane)
        self._keys[lane] = rng.integers(2**64, dtype=np.uint64)
        unit = np.asanyarray(rng.uniform(-1.0, 1.0, Unit.size)).reshape(Unit.size, -1)
        parameters = SensorParameters(np.empty_like(unit, shape=(SensorParameters.size, len(lanes))))
        for name in SENSOR_PARAMETERS:
            getattr(parameters, name)[:] = getattr(self._electronics, name)
        for name, (low, high) in self._ranges.items():
            if name in SENSOR_PARAMETERS:
                getattr(parameters, name)[:] = rng.uniform(low, high)
        errors = Errors(np.empty_like(unit, shape=(Errors.size, len(lanes))))
        over(work_out, parameters, Unit(unit), Shared(self._shared), errors)
        # Drawn last, so that all else is drawn as on a rig without such a sensor.
        most = np.repeat([self._electronics.acceleration_bias, self._electronics.acceleration_gain_error], 2)
        drawn = most[:, None] * np.asanyarray(rng.uniform(-1.0, 1.0, 4)).reshape(4, -1)
        errors.acceleration_bias[:], errors.acceleration_gain[:] = drawn[:2], drawn[2:]
        self._errors[:, lanes] = errors.rows

    @property
    def tells_acceleration(self) -> bool:
        return Shared(self._shared).share > 0.0

    @property
    def _tables(self) -> tuple[NDArray[Any], ...]:
        tables = (self._keys.view(np.float64), self._errors, self._queue, self._arrived, self._passed, self._late)
        return (*tables, self._readings, self._accelerometer)

    def stage(self) -> Stage:
        return Stage(_look, self._shared, tables=self._tables)
