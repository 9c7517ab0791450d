"""Sensors that can be exchanged while the rig runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Measurement
from birthsim_env.parts.sensors.sensors import SENSORS, put_out
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.electronics import Electronics


class ExchangeableSensors:
    """Sensors of one lane on a clock of their own, which starts where they first measure: a tracker that is put in place of
    exact sensors has its first sample at once, as at the start of an episode."""

    sampled = True
    """One of those that may be put in place is."""

    def __init__(self, name: str, electronics: Electronics, rng: np.random.Generator) -> None:
        self._electronics = electronics
        self.exchange(name, rng)

    def exchange(self, name: str, rng: np.random.Generator) -> None:
        """From the next measurement on use the sensors ``name``."""
        self._sensors = SENSORS[name](self._electronics, 1)
        self.begin(0, rng)

    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start anew."""
        self._sensors.begin(lane, rng)
        self._first: int | None = None

    def measure(self, ticks: NDArray[np.int64], time: Array, motion: Array, pressures: Array, force: Array) -> Measurement:
        """As every sensor model; the times that it tells are those of the caller's clock."""
        if self._first is None:
            self._first = int(ticks[0])
        if self._first == 0:
            return self._sensors.measure(ticks, time, motion, pressures, force)
        since, period = ticks - self._first, self._electronics.control_period
        begun = self._first * period
        seen = self._sensors.measure(since, since.astype(np.float64) * period, motion, pressures, force)
        return replace(seen, time=time, position_time=seen.position_time + begun)

    def put_out(self, ticks: NDArray[np.int64], openings: Array) -> Array:
        """What reaches the valves of ``openings`` (4, 1) behind the sensors' control board."""
        return openings if self._first is None else put_out(self._sensors, ticks - self._first, openings)
