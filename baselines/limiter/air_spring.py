"""The rig as an air spring: valves that keep the air which the chambers had where the hand and the rig were in balance."""

from __future__ import annotations

import math

import numpy as np

from baselines.valve_inverse import openings_for_flows
from baselines.limiter.past import Past
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.geometry import joint_force
from birthsim_env.physics.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters

RETURN = 0.02
MEMORY = 0.5
HAND = 1.0
OLDER = 0.0

SIGNS = np.array([[1.0], [-1.0], [1.0], [-1.0]])


class AirSpring:
    def __init__(self, parameters: Parameters, lanes: int) -> None:
        p = self._p = parameter_column(parameters)
        self._parameters = parameters
        self._period = parameters.electronics.control_period
        self._areas = p[[at.AREA_P1, at.AREA_N1, at.AREA_P2, at.AREA_N2], None]
        self._middle = np.repeat(p[[at.HALF_L1, at.HALF_L2], None], 2, axis=0) + p[at.DEAD_VOLUME] / self._areas
        self._past = Past(self._period, 6, lanes)
        self._forces = np.full((4, lanes), np.nan)

    def reset(self, lanes: Mask) -> None:
        self._past.reset(lanes)
        self._forces[:, lanes] = np.nan

    def pistons(self, position: Array) -> Array:
        joints = np.empty((4, position.shape[1]))
        pistons_at(np.concatenate([position, np.zeros_like(position)]), self._p, joints)
        return joints[:2]

    def openings(self, measurement: Measurement, reference: Reference) -> Array:
        late = measurement.time - measurement.position_time + OLDER
        past = self._past.at(late, np.concatenate([measurement.pressures, measurement.user_force]))
        pressures, force = past[:4], past[4:]
        pistons = self.pistons(measurement.position)
        here = self._middle + SIGNS * np.repeat(pistons, 2, axis=0)
        there = self._middle + SIGNS * np.repeat(self.pistons(reference.position), 2, axis=0)
        present = pressures * self._areas
        hand = HAND * np.repeat(joint_force(force, pistons, self._parameters), 2, axis=0)
        balanced = present + SIGNS * hand * here / (2.0 * self._middle)
        self._forces = np.where(np.isnan(self._forces), balanced, self._forces)
        self._forces += -math.expm1(-self._period / MEMORY) * (balanced - self._forces)
        flows = (self._forces * there - present * here) / RETURN / (self._p[at.GAS] * self._p[at.TEMPERATURE])
        return openings_for_flows(flows, measurement.pressures, self._p)
