"""Observers over N lanes outside a stage: their kernels, and the memory that a stage keeps for them."""

from __future__ import annotations

import numpy as np

from baselines.estimation import disturbance_observer, observers
from birthsim_env.loop.signals import Mask, Measurement
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters


class Sampled:
    """``observers.observe``: ``memory`` (M, N) after each ``update``, which returns y1, y2, v1, v2."""

    def __init__(self, rig: Parameters, bandwidth: float = observers.BANDWIDTH) -> None:
        self._rig, self._p, self._bandwidth, self._fresh = rig, parameter_column(rig), bandwidth, observers.fresh_memory(rig)
        self.memory = np.zeros((len(self._fresh), 0))

    @property
    def disturbance(self) -> Array:
        return self.memory[observers.DISTURBANCE : observers.REST]

    @property
    def rest(self) -> Array:
        return self.memory[observers.REST : observers.INNOVATION]

    def reset(self, lanes: Mask) -> None:
        if self.memory.shape[1]:
            self.memory[:, lanes] = self._fresh[:, None]

    def update(
        self, seen: Measurement, force: Array | None = None, believed: Array | None = None, moving: Array | None = None
    ) -> Array:
        board, lanes = self._rig.electronics, seen.position.shape[1]
        if self.memory.shape[1] != lanes:
            self.memory = np.repeat(self._fresh[:, None], lanes, axis=1)
        nothing = np.zeros((2, lanes))
        observers.observe(
            self.memory, seen.time, seen.position, seen.position_time, seen.velocity, seen.pressures, self._p,
            board.control_period, self._bandwidth, np.full(lanes, board.position_noise), nothing if force is None else force,
            nothing if believed is None else believed, np.ones(lanes) if moving is None else moving,
        )  # fmt: skip
        return self.memory[: observers.DISTURBANCE]


class Measured:
    """``disturbance_observer.observe``: ``disturbance`` (2, N) after each ``update``, which returns y1, y2, v1, v2."""

    def __init__(self, rig: Parameters, bandwidth: float, lanes: int) -> None:
        self._numbers = (parameter_column(rig), rig.electronics.control_period, bandwidth)
        self._estimate, self.fresh = np.zeros((4, lanes)), np.ones(lanes)

    @property
    def disturbance(self) -> Array:
        return self._estimate[2:]

    def update(self, seen: Measurement, force: Array, believed: Array) -> Array:
        joints = np.empty_like(self._estimate)
        disturbance_observer.observe(
            self._estimate, seen.position, seen.velocity, seen.pressures, force, believed, *self._numbers, self.fresh, joints
        )
        self.fresh[:] = 0.0
        return joints
