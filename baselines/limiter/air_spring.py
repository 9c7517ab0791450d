"""The rig as an air spring: valves that keep the air which the chambers had where the hand and the rig were in balance."""

from __future__ import annotations

import math

import numpy as np

from baselines.valve_inverse import openings_for_flows
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters

RETURN = 0.02
MEMORY = 0.5


class AirSpring:
    def __init__(self, parameters: Parameters, lanes: int) -> None:
        p = self._p = parameter_column(parameters)
        self._period = parameters.electronics.control_period
        self._areas = p[[at.AREA_P1, at.AREA_N1, at.AREA_P2, at.AREA_N2], None]
        self._middle = np.repeat(p[[at.HALF_L1, at.HALF_L2], None], 2, axis=0) + p[at.DEAD_VOLUME] / self._areas
        self._pressures = np.full((4, lanes), np.nan)

    def reset(self, lanes: Mask) -> None:
        self._pressures[:, lanes] = np.nan

    def lengths(self, position: Array) -> Array:
        joints = np.empty((4, position.shape[1]))
        pistons_at(np.concatenate([position, np.zeros_like(position)]), self._p, joints)
        return np.asarray(self._middle + np.repeat(joints[:2], 2, axis=0) * np.array([[1.0], [-1.0], [1.0], [-1.0]]))

    def openings(self, measurement: Measurement, reference: Reference, authority: Array) -> Array:
        here, there = self.lengths(measurement.position), self.lengths(reference.position)
        present = measurement.pressures * here / there
        self._pressures = np.where(np.isnan(self._pressures), present, self._pressures)
        wanted = (self._pressures - present) * there * self._areas / RETURN
        self._pressures += authority * -math.expm1(-self._period / MEMORY) * (present - self._pressures)
        flows = wanted / (self._p[at.GAS] * self._p[at.TEMPERATURE])
        return openings_for_flows(flows, measurement.pressures, self._p)
