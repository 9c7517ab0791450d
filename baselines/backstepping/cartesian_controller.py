"""Backstepping that renders any symmetric positive definite stiffness matrix, where (18) keeps only the diagonal of J^T K J."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from baselines.backstepping import cartesian_law
from baselines.backstepping.controller import PNEUMATIC_GAIN, SIGN_WIDTH
from baselines.backstepping.impedance import cartesian_impedance
from baselines.controller import lanes_of, require_stiffness
from baselines.estimation.observers import PistonObserver, measured_joints
from baselines.impedance import Impedance
from birthsim_env.loop.signals import Mask, Measurement, Reference, one_lane
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import is_within, limits, shown


class CartesianBackstepping:
    """The law of ``cartesian_law``: weight compensated, force before pneumatic stiffness, no force sensor.

    Arguments as in ``BacksteppingController``. Raises ``ValueError`` for those that are not positive.
    """

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        pneumatic_gain: float = PNEUMATIC_GAIN,
        sign_width: float = SIGN_WIDTH,
    ) -> None:
        for name, value in (("pneumatic_gain", pneumatic_gain), ("sign_width", sign_width)):
            if not is_within(value, least=1e-6, most=1e6):
                raise ValueError(f"{name} = {shown(value)}; allowed: a positive number{limits(least=1e-6, most=1e6)}")
        self.parameters = rig = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._options = (pneumatic_gain, sign_width)
        # With 3 C <= D/m the loop of ``cartesian_law`` has no positive stiffness of its own.
        least_gain = max(rig.cylinder1.viscous_friction, rig.cylinder2.viscous_friction) / (3 * rig.mechanics.mass)
        self._least_stiffness = rig.mechanics.mass * (least_gain**2 + 2) / 3
        self._observer = PistonObserver(self.parameters, self._p)

    def declared_impedance(self, reference: Reference) -> Impedance:
        """What the gain matrices render to slow pushes at the reference pose, over N lanes."""
        require_stiffness(reference, self._least_stiffness)
        return cartesian_impedance(reference, self.parameters)

    def reset(self, lanes: Mask | None = None) -> None:
        self._observer.reset(lanes)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        Raises ``ValueError`` for signals over different numbers of lanes, and for a stiffness setpoint, a few 10 N/m, that is
        too soft for positive gains.
        """
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        lanes = lanes_of(measurement, reference)
        require_stiffness(reference, self._least_stiffness)
        if measurement.sampled:
            joints = np.ascontiguousarray(self._observer.update(measurement))
        else:
            joints = measured_joints(measurement, self._p)
        openings = np.empty((4, lanes))
        cartesian_law.command(joints, measurement.pressures, reference.rows, self._p, *self._options, openings)
        return openings
