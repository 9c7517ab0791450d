"""Observers over N lanes outside a stage: their kernels, and the memory that a stage keeps for them."""

import numpy as np

from baselines.estimation import disturbance_observer, observers
from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from birthsim_env.loop.rows import Signals, fill_measurement
from birthsim_env.loop.signals import Joints, Measurement, Point
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters


def given(lanes: int, force: Array | None, believed: Array | None, moving: Array | None, assumed: AssumedParameters) -> Inputs:
    """Nothing but what is given; where ``moving`` is not, no piston may rest."""
    record = Inputs(np.zeros((Inputs.size, lanes)))
    record.moving[:], record.noise[:] = 1.0 if moving is None else moving, assumed.noise
    record.inverse_mass[:] = assumed.rig.inverse_mass
    record.force[:], record.believed[:] = 0.0 if force is None else force, 0.0 if believed is None else believed
    return record


class Sampled:
    """``observers.observe``: ``pistons`` after each ``update``, which returns y1, y2, v1, v2."""

    def __init__(self, rig: Parameters, bandwidth: float = observers.BANDWIDTH) -> None:
        self._assumed, self._fresh = (
            AssumedParameters(observers.assumed_parameters(rig, bandwidth)),
            observers.fresh_memory(rig, sampled=True),
        )
        self._lanes = 0

    def update(
        self, seen: Measurement, force: Array | None = None, believed: Array | None = None, moving: Array | None = None
    ) -> Array:
        lanes = seen.position.shape[1]
        if self._lanes != lanes:
            self._lanes, self.pistons = lanes, Pistons(np.repeat(self._fresh[:, None], lanes, axis=1))
        signals = Signals(np.zeros((Signals.size, lanes)))
        fill_measurement(signals.rows, seen)
        known = given(lanes, force, believed, moving, self._assumed)
        observers.observe(self.pistons, signals, signals.pressure, known, self._assumed)
        return self.pistons.rows[: Joints.size]


class Measured:
    """``disturbance_observer.observe``: ``pistons`` after each ``update``, which returns y1, y2, v1, v2."""

    def __init__(self, rig: Parameters, bandwidth: float, lanes: int) -> None:
        fresh = observers.fresh_memory(rig, sampled=False)
        self._assumed, self.pistons = (
            AssumedParameters(observers.assumed_parameters(rig, bandwidth)),
            Pistons(np.repeat(fresh[:, None], lanes, axis=1)),
        )

    def update(self, seen: Measurement, force: Array, believed: Array) -> Array:
        point, lanes = Point(np.concatenate([seen.position, seen.velocity])), seen.position.shape[1]
        joints = Joints(np.empty((Joints.size, lanes)))
        known = given(lanes, force, believed, None, self._assumed)
        air = np.ascontiguousarray(seen.pressures)
        disturbance_observer.observe(self.pistons, point, air, known, self._assumed, joints, lanes)
        return joints.rows
