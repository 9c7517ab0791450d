"""Parts of a residual's stage by themselves, over N lanes: what limits its authority, and what it finds unexplained."""

import numpy as np

from agents.residual import authority, unexplained
from birthsim_env.loop.signals import Joints, Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.observed import Measured, Sampled


class AuthorityLimiter:
    """``fraction`` (2, N) of the authority that is left along cylinders 1 and 2, and ``softness`` (N,) for the law."""

    def __init__(self, period: float, lane_parameters: Array) -> None:
        self._period, self._p, self._limiter = period, lane_parameters, authority.Limiter(np.zeros((authority.Limiter.size, 0)))

    @property
    def fraction(self) -> Array:
        return self._limiter.left

    @property
    def softness(self) -> Array:
        return self._limiter.softness

    def reset(self, lanes: Mask) -> None:
        if self._limiter.rows.shape[1] != len(lanes):
            self._limiter = authority.Limiter(np.zeros((authority.Limiter.size, len(lanes))))
        self._limiter.rows[:, lanes] = authority.Limiter.lane(left=1.0)[:, None]

    def update(self, joints: Array, reference: Reference) -> None:
        p, lanes = Rig(self._p), joints.shape[1]
        authority.limit_authority(Joints(joints), reference, p, self._period, authority.LEVEL, self._limiter, lanes)


class UnexplainedForceObserver:
    """``met`` (6, N) of N lanes, brought up once per control period."""

    def __init__(self, parameters: Parameters) -> None:
        self._period, self._p = parameters.electronics.control_period, parameter_column(parameters)
        self._rig, self._sampled = parameters, Sampled(parameters)
        self.met: Array = np.zeros((unexplained.Forces.size, 0))
        self.joints: Array = np.zeros((4, 0))

    def reset(self, lanes: Mask) -> None:
        if self.met.shape[1] != len(lanes):
            self.met, self._seen = (
                np.zeros((unexplained.Forces.size, len(lanes))),
                np.zeros((unexplained.Moved.size, len(lanes))),
            )
            self._measured = Measured(self._rig, unexplained.BANDWIDTH, len(lanes))
            self._sampled = Sampled(self._rig)
        self._measured.pistons.fresh[lanes] = 1.0
        self._sampled.reset(lanes)
        self.met[:, lanes], self._seen[:, lanes] = 0.0, 0.0

    def update(self, measurement: Measurement) -> None:
        force = np.ascontiguousarray(measurement.user_force)
        observer = self._sampled if measurement.sampled else self._measured
        self.joints = np.ascontiguousarray(observer.update(measurement, force, np.zeros_like(force)))
        disturbance = np.ascontiguousarray(observer.pistons.disturbance)
        ways, met = unexplained.Moved(self._seen), unexplained.Forces(self.met)
        unexplained.remember(Joints(self.joints), disturbance, Rig(self._p), self._period, ways, met, disturbance.shape[1])
