"""The paper's controller as a user calls it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from baselines import backstepping_law
from baselines.observers import PistonObserver
from birthsim_env.compilation import kernel
from birthsim_env.inverse_kinematics import piston_motion
from birthsim_env.lanes import Array, parameter_column
from birthsim_env.parameters import Parameters, load_parameters
from birthsim_env.signals import REFERENCES, Mask, Measurement, Reference, one_lane

PNEUMATIC_GAIN = 30.0
"""c4, 1/s; assumed: the pneumatic stiffness settles within 0.1 s and leaves the valves to the force."""

SIGN_WIDTH = 0.002
"""m/s; assumed: over this speed the law's sign(v) goes from rest to sliding; close to the paper's discontinuous sign."""


@kernel
def _measured_joints(position: Array, velocity: Array, p: Array, joints: Array) -> None:
    motion, one = np.empty((4, 1)), np.empty((4, 1))
    for i in range(position.shape[1]):
        motion[0, 0], motion[1, 0] = position[0, i], position[1, i]
        motion[2, 0], motion[3, 0] = velocity[0, i], velocity[1, i]
        piston_motion(motion, p, one, 1)
        for row in range(4):
            joints[row, i] = one[row, 0]


class BacksteppingController:
    """Backstepping control of position, pneumatic and closed-loop stiffness (Herzig et al. 2015, section IV and Fig. 3).

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        weight_compensation: put (14), weight and centrifugal force on cylinder 2, back into the model (the paper's section VI).
        pneumatic_gain: c4, 1/s, of the pneumatic stiffness.
        sign_width: speed, m/s, over which the sign of (4) is smoothed.

    The gains follow the setpoints Kclx, Kcly at every call (18). From sampled positions an observer estimates the speeds.
    Raises ``ValueError`` for gains that are not positive.
    """

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        weight_compensation: bool = False,
        pneumatic_gain: float = PNEUMATIC_GAIN,
        sign_width: float = SIGN_WIDTH,
    ) -> None:
        for name, value in (("pneumatic_gain", pneumatic_gain), ("sign_width", sign_width)):
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}; allowed: a positive number")
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._options = (float(pneumatic_gain), float(sign_width), float(bool(weight_compensation)))
        self._observer = PistonObserver(self.parameters, self._p)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True. Only the observer has a memory."""
        self._observer.reset(lanes)

    def command(self, measurement: Measurement, reference: Reference, believed_force: Array | None = None) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        ``believed_force`` (2, N), N, along cylinders 1 and 2, is added to what the law believes acts on the pistons.
        Raises ``ValueError`` for signals over different numbers of lanes.
        """
        if measurement.position.ndim == 1:
            told = None if believed_force is None else np.asarray(believed_force, dtype=np.float64)[..., None]
            return self.command(*one_lane(measurement, reference), told)[:, 0]
        lanes = measurement.position.shape[1]
        believed = np.zeros((2, lanes)) if believed_force is None else np.ascontiguousarray(believed_force, dtype=np.float64)
        for name, signal, rows in (
            ("measurement.position", measurement.position, 2),
            ("measurement.velocity", measurement.velocity, 2),
            ("measurement.pressures", measurement.pressures, 4),
            ("reference.rows", reference.rows, REFERENCES),
            ("believed_force", believed, 2),
        ):
            if signal.shape != (rows, lanes):
                raise ValueError(
                    f"{name} has shape {signal.shape}; allowed: {(rows, lanes)}, with the lanes of measurement.position"
                )
        if measurement.sampled:
            joints = np.ascontiguousarray(self._observer.update(measurement))
        else:
            joints = np.empty((4, lanes))
            _measured_joints(measurement.position, measurement.velocity, self._p, joints)
        openings = np.empty((4, lanes))
        backstepping_law.command(joints, measurement.pressures, reference.rows, believed, self._p, *self._options, openings)
        return openings
