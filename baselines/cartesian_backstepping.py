"""Backstepping that renders any symmetric positive definite stiffness matrix, where (18) keeps only the diagonal of J^T K J."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from baselines import cartesian_law
from baselines.backstepping import PNEUMATIC_GAIN, SIGN_WIDTH, _measured_joints
from baselines.observers import PistonObserver
from birthsim_env.lanes import Array, parameter_column
from birthsim_env.parameters import Parameters, load_parameters
from birthsim_env.signals import Mask, Measurement, Reference, one_lane


class CartesianBackstepping:
    """The law of ``cartesian_law``: weight compensated, force before pneumatic stiffness, no force sensor.

    Arguments as in ``BacksteppingController``.
    """

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        pneumatic_gain: float = PNEUMATIC_GAIN,
        sign_width: float = SIGN_WIDTH,
    ) -> None:
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._options = (pneumatic_gain, sign_width)
        self._observer = PistonObserver(self.parameters, self._p)

    def reset(self, lanes: Mask | None = None) -> None:
        self._observer.reset(lanes)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        lanes = measurement.position.shape[1]
        if measurement.sampled:
            joints = np.ascontiguousarray(self._observer.update(measurement))
        else:
            joints = np.empty((4, lanes))
            _measured_joints(measurement.position, measurement.velocity, self._p, joints)
        openings = np.empty((4, lanes))
        cartesian_law.command(joints, measurement.pressures, reference.rows, self._p, *self._options, openings)
        return openings
