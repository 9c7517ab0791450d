"""What a controller with a force sensor knows at one instant: the motion that the hand should find, and the state of the rig.

A Cartesian ``Admittance`` turns the measured force into the motion. Friction is fed forward along this motion. Observers
estimate the rest of what is not known of the rig: ``DisturbanceObserver`` where speeds are measured, and ``PistonObserver`` and
``ChamberObserver`` from sampled positions and noisy pressures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from baselines.controller import lanes_of
from baselines.estimation.admittance import Admittance, mark_moving
from baselines.estimation.chamber_observer import ChamberObserver
from baselines.estimation.disturbance_observer import DisturbanceObserver
from baselines.estimation.observers import PistonObserver
from baselines.estimation.reference_friction import ReferenceFriction
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters

BELIEVED_LIMIT = 120.0
"""N; assumed: no more than this is believed to act unseen on a piston: 2 kg of mass and 25 N of friction are below it."""


@helper
def disturbance_forces(joints: Array, believed: Array, disturbance: Array, p: Array, force: Array) -> None:
    """Writes ``force`` (2, N), N: what is ``believed`` to act along the pistons, and what their ``disturbance`` adds, m/s2."""
    for i in range(joints.shape[1]):
        kappa = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )[5]
        for cylinder in range(2):
            mass = p[at.MASS] * kappa * kappa if cylinder == 0 else p[at.MASS]
            observed = max(-BELIEVED_LIMIT, min(BELIEVED_LIMIT, mass * disturbance[cylinder, i]))
            force[cylinder, i] = believed[cylinder, i] + observed


@dataclass(frozen=True)
class Estimate:
    """N lanes at one instant. The arrays are good until the next ``update``.

    - ``motion`` (8, N): x and y that are wanted, and three derivatives, SI;
    - ``force`` (2, N), N: the hand's;
    - ``joints`` (4, N): y1, y2, v1, v2;
    - ``pressures`` (4, N), Pa, and ``spools`` (4, N) of chambers P1, N1, P2, N2;
    - ``believed`` (2, N), N: other forces that are believed to act along the pistons;
    - ``disturbance`` (2, N), m/s2: accelerations of the pistons that are still unexplained;
    - ``disturbance_force`` (2, N), N: the last two together;
    - ``moving`` (N,): 1 where the motion moves;
    - ``rest`` (2, N): how far each piston is taken to rest, 0 to 1.
    """

    motion: Array
    force: Array
    joints: Array
    pressures: Array
    spools: Array
    believed: Array
    disturbance: Array
    disturbance_force: Array
    moving: Array
    rest: Array


class StateEstimator:
    """The ``Estimate`` of N lanes, one control period at a time, for one kind of sensors.

    Arguments: the rig as believed, and ``sampled``, whether positions are samples. ``gains`` has three entries: bandwidth, 1/s,
    of the observer of disturbances; pressure_bandwidth, 1/s, of the observer of pressures (for sampled sensors);
    friction_fraction, the fraction of the believed friction that is fed forward along the motion.
    """

    def __init__(self, parameters: Parameters, sampled: bool, gains: Mapping[str, float]) -> None:
        self._p = p = parameter_column(parameters)
        period = parameters.electronics.control_period
        self._admittance = Admittance(parameters)
        self._friction, self._friction_fraction = ReferenceFriction(period, p), gains["friction_fraction"]
        self._chambers = ChamberObserver(period, p, gains["pressure_bandwidth"] if sampled else math.inf)
        self._pistons = (
            PistonObserver(parameters, p, gains["bandwidth"]) if sampled else DisturbanceObserver(period, p, gains["bandwidth"])
        )
        self._joints: Array = np.empty((4, 0))

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        for part in (self._admittance, self._friction, self._chambers, self._pistons):
            part.reset(lanes)

    def update(self, measurement: Measurement, reference: Reference, damping_factor: Array | None = None) -> Estimate:
        """Take one control period's signals over N lanes. ``damping_factor`` (N,) multiplies the damping of the motion.

        Raises ``ValueError`` for signals over different numbers of lanes, and a stiffness that is not positive definite.
        """
        lanes = lanes_of(measurement, reference)
        if self._joints.shape[1] != lanes:
            self._joints = np.zeros((4, lanes))
        motion = self._admittance.update(measurement, reference, damping_factor)
        pressures = self._chambers.update(measurement.pressures, self._joints)
        measurement = replace(measurement, pressures=pressures)
        force = np.ascontiguousarray(measurement.user_force)
        believed = -self._friction_fraction * self._friction.update(motion)
        moving = np.empty(lanes)
        mark_moving(motion, moving)
        pistons = self._pistons
        if isinstance(pistons, PistonObserver):
            self._joints, rest = np.ascontiguousarray(pistons.update(measurement, force, believed, moving)), pistons.rest
        else:
            self._joints, rest = pistons.update(measurement, force, believed), np.zeros((2, lanes))
        disturbance = np.ascontiguousarray(pistons.disturbance)
        disturbance_force = np.empty((2, lanes))
        disturbance_forces(self._joints, believed, disturbance, self._p, disturbance_force)
        spools = self._chambers.spools
        return Estimate(motion, force, self._joints, pressures, spools, believed, disturbance, disturbance_force, moving, rest)

    def forecast(self, now: Estimate, reference: Reference, ticks: NDArray[np.int64]) -> tuple[Array, Array]:
        """The motion's x, y (m), vx, vy (m/s), (M, 4, N), and the forces unseen along it, N, (M, 2, N), so many periods after
        ``now``, the last situation: friction follows the motion, what was observed besides stays."""
        ahead = self._admittance.forecast(reference, now.force, ticks)
        friction = self._friction.forecast(ahead, ticks)
        return ahead, now.disturbance_force - now.believed - self._friction_fraction * friction

    def commanded(self, openings: Array) -> None:
        """What the valves are told until the next ``update``: openings (4, N)."""
        self._chambers.openings[:] = openings
