"""What a residual finds unexplained, by itself, over N lanes."""

import numpy as np

from agents.residual import unexplained
from birthsim_env.loop.signals import Joints, Measurement
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.observed import Measured, Sampled


class UnexplainedForceObserver:
    """``met`` (6, N) of N lanes, brought up once per control period."""

    def __init__(self, parameters: Parameters, lanes: int) -> None:
        self._period, self._p = parameters.electronics.control_period, parameter_column(parameters)
        self._sampled, self._measured = Sampled(parameters), Measured(parameters, unexplained.BANDWIDTH, lanes)
        self._measured.pistons.fresh[:] = 1.0
        self.met, self._seen = np.zeros((unexplained.Forces.size, lanes)), np.zeros((unexplained.Moved.size, lanes))

    def update(self, measurement: Measurement) -> None:
        force = np.ascontiguousarray(measurement.user_force)
        observer = self._sampled if measurement.sampled else self._measured
        joints = np.ascontiguousarray(observer.update(measurement, force, np.zeros_like(force)))
        disturbance = np.ascontiguousarray(observer.pistons.disturbance)
        ways, met = unexplained.Moved(self._seen), unexplained.Forces(self.met)
        unexplained.remember(Joints(joints), disturbance, Rig(self._p), self._period, ways, met, disturbance.shape[1])
