"""The three sensor models.

``ideal`` sees everything at every control period. ``lab`` is a magnetic tracker and pressure cells with noise and latency.
``honest`` also has the errors that data sheets state: of a force sensor, a tracker, pressure cells and a control board.

A sensor model's ``measure`` is called whenever somebody looks: at every control period where ``sampled`` is True, else at
every policy period.
"""

from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import Measurement
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.drawn.seeding import vectorised
from birthsim_env.parts.sensors.honest_sensors import BoardSensors, HonestSensors
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PRESSURES, Array
from birthsim_env.physics.electronics import Electronics

ACCELEROMETER = ("acceleration_bandwidth", "acceleration_noise")
"""Figures besides those of tracker and pressure cells that ``lab`` has too."""


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


class LabSensors(BoardSensors):
    """A tracker with a rate of its own, noise and latency; noisy pressure cells read at every control period, and so is an
    acceleration sensor where the rig has one.

    No velocity is measured: in its place stands the low-passed difference of samples. The user's force is that of an ideal
    force sensor.
    """

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        errors = [name for name, one in electronics.parameters.items() if one.option and one.least == 0]
        no_errors: dict[str, Any] = {name: 0.0 for name in errors if name not in ACCELEROMETER}
        super().__init__(replace(electronics, **no_errors), num_envs)


class SensorModel(Protocol):
    """What measures; ``sampled`` is True where it must look at every control instant."""

    sampled: bool

    def __init__(self, electronics: Electronics, num_envs: int) -> None: ...

    def begin(self, lane: int, rng: np.random.Generator) -> None: ...

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement: ...


SENSORS: dict[str, type[SensorModel]] = {"ideal": IdealSensors, "lab": LabSensors, "honest": HonestSensors}
"""A model that has ``drawn``, names of parameters, and ``vary(ranges)`` draws these for every episode where rigs are drawn;
one that has ``put_out(ticks, openings)`` and ``board_stage()`` stands between a controller's openings and the valves too."""


def drawn_by(sensors: str) -> tuple[str, ...]:
    """Dotted names of the parameters that the sensor model ``sensors`` can draw for every episode."""
    return getattr(SENSORS[sensors], "drawn", ())
