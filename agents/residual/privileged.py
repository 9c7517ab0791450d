"""What a privileged policy observes besides: the true parameters of the rig that was drawn, and what its sensors do wrong.

No controller can know them. A policy that does says what is left to be learned by one that guesses them from measurements.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.sensors.honest import HonestSensors
from birthsim_env.parts.sensors.sensor_errors import Errors
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array

PolicyFunction = Callable[[NDArray[np.float32]], NDArray[Any]]

DRAWN = (
    *(at.MASS, at.FC1, at.FC2, at.FP1, at.FP2, at.FV1, at.FV2, at.S0, at.TAU, at.DEAD_VOLUME, at.H_WALL),
    *(at.SUPPLY_OVERLAP_P1, at.SUPPLY_SLOPE_P1, at.EXHAUST_OVERLAP_P1, at.EXHAUST_SLOPE_P1),
    *(at.SUPPLY, at.AREA_P1, at.AREA_P2),
)
"""Rows of the parameters that randomisation of a rig draws, the last three from ranges of one's own. Friction: Coulomb, what
pressure adds, and viscous, of cylinders 1 and 2, and the bristles. All valves have the edges of the first; overlap and slope,
(1 + c)/(1 - d), tell the curvature. Areas of pistons tell the bores."""

PRESSURE_UNIT, PLACE_UNIT = 2000.0, 1e-3
"""Pa and m that are observed as 1: the default bias of a pressure cell, and the default distortion of the tracker."""

TRUE_NAMES = (
    *(f"true {at.PARAMETER_NAMES[row]}" for row in DRAWN),
    *(f"bias of cell {cell}" for cell in ("P1", "N1", "P2", "N2")), *(f"error of the tracker along {axis}" for axis in "xy"),
)  # fmt: skip
TRUE_PARAMETERS = len(TRUE_NAMES)
"""What these numbers are, and how many."""


def true_parameters(env: Any) -> NDArray[np.float32]:
    """Of the lanes of a vector environment now, (N, TRUE_PARAMETERS).

    They are the parameters ``DRAWN`` over those that the owner describes, or as they are where these are zero; the biases of
    the four pressure cells; and by how much scale and distortion move the place that the tracker shows, x and y.

    Without ``honest`` sensors the last six are zero.
    """
    simulation, rows = env.simulation, list(DRAWN)
    parameters: Array = np.zeros((TRUE_PARAMETERS, env.num_envs))
    described = simulation.nominal[rows, None]
    parameters[: len(rows)] = simulation.plant.lane_parameters[rows] / np.where(described == 0.0, 1.0, described)
    if isinstance(simulation.sensors, HonestSensors):
        parameters[len(rows) : -2] = Errors(simulation.sensors.errors).cells / PRESSURE_UNIT
        parameters[-2:] = simulation.sensors.shift(simulation.motion[:2]) / PLACE_UNIT
    return parameters.T.astype(np.float32)


def with_true_parameters(env: Any, observations: NDArray[np.float32]) -> NDArray[np.float32]:
    """Observations (N, D) of a vector environment with its ``true_parameters``, (N, D + TRUE_PARAMETERS)."""
    return np.concatenate([observations, true_parameters(env)], axis=1)


def acting(policy: PolicyFunction, env: Any, privileged: bool) -> PolicyFunction:
    """What a ``policy`` does in ``env``: observations (N, D) -> actions (N, size); a ``privileged`` one observes
    the true parameters too."""
    return (lambda seen: policy(with_true_parameters(env, seen))) if privileged else policy
