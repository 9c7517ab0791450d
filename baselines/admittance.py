"""The motion that a hand should find: a Cartesian mass, damper and spring about the target, driven by the measured force.

    m (xr'' - xt'') + B (xr' - xt') + K (xr - xt) = Fu,   B = 2 zeta (m K)^(1/2)

with the full symmetric stiffness matrix K. At rest it stands on the compliant target (19); a controller that follows it renders
K, whatever its own stiffness. The mass is the rig's own, so that the hand feels no other inertia than what it moves anyway.
"""

from __future__ import annotations

import math

import numpy as np

from baselines.controller import require_stiffness
from birthsim_env.compilation import helper, kernel
from birthsim_env.lanes import Array
from birthsim_env.parameters import Parameters
from birthsim_env.signals import Mask, Measurement, Reference

DAMPING_RATIO = 0.9
"""assumed: hardly any overshoot, and no slower than the rig needs to be."""


@helper
def square_root(xx: float, yy: float, xy: float) -> tuple[float, float, float]:
    """Square root of the symmetric positive definite matrix [[xx, xy], [xy, yy]]: its entries xx, yy, xy."""
    root = math.sqrt(xx * yy - xy * xy)
    trace = math.sqrt(xx + yy + 2.0 * root)
    return (xx + root) / trace, (yy + root) / trace, xy / trace


@kernel
def _update(
    offset: Array, reference: Array, force: Array, mass: float, ratio: float, period: float, fresh: Array, motion: Array
) -> None:
    """``offset`` (4, N): xr - xt and its rate, carried on by one period where ``fresh`` (N,) is 0. ``motion`` (8, N)."""
    for i in range(offset.shape[1]):
        kxx, kyy, kxy = reference[8, i] / mass, reference[9, i] / mass, reference[14, i] / mass
        bxx, byy, bxy = square_root(kxx, kyy, kxy)
        bxx, byy, bxy = 2.0 * ratio * bxx, 2.0 * ratio * byy, 2.0 * ratio * bxy
        fx, fy = force[0, i] / mass, force[1, i] / mass
        if fresh[i] > 0.0:
            offset[0, i], offset[1, i], offset[2, i], offset[3, i] = 0.0, 0.0, 0.0, 0.0
        x, y, vx, vy = offset[0, i], offset[1, i], offset[2, i], offset[3, i]
        # The measured force is held: its rate is left out here, and by whoever follows, for whom the two cancel.
        ax, ay = fx - bxx * vx - bxy * vy - kxx * x - kxy * y, fy - bxy * vx - byy * vy - kxy * x - kyy * y
        jx, jy = -bxx * ax - bxy * ay - kxx * vx - kxy * vy, -bxy * ax - byy * ay - kxy * vx - kyy * vy
        motion[0, i], motion[1, i] = reference[0, i] + x, reference[1, i] + y
        motion[2, i], motion[3, i] = reference[2, i] + vx, reference[3, i] + vy
        motion[4, i], motion[5, i] = reference[4, i] + ax, reference[5, i] + ay
        motion[6, i], motion[7, i] = reference[6, i] + jx, reference[7, i] + jy
        sx, sy = -bxx * jx - bxy * jy - kxx * ax - kxy * ay, -bxy * jx - byy * jy - kxy * ax - kyy * ay
        # Taylor's series to the third order: the system is linear and w x period is below 0.06.
        offset[0, i] = x + period * (vx + period * (ax / 2.0 + period * jx / 6.0))
        offset[1, i] = y + period * (vy + period * (ay / 2.0 + period * jy / 6.0))
        offset[2, i] = vx + period * (ax + period * (jx / 2.0 + period * sx / 6.0))
        offset[3, i] = vy + period * (ay + period * (jy / 2.0 + period * sy / 6.0))


class Admittance:
    """The reference motion of N lanes, one control period at a time.

    Arguments: ``parameters``, the rig as believed (its mass and control period); ``damping_ratio``, zeta, more than 0.
    """

    def __init__(self, parameters: Parameters, damping_ratio: float = DAMPING_RATIO) -> None:
        if not (math.isfinite(damping_ratio) and damping_ratio > 0):
            raise ValueError(f"damping_ratio = {damping_ratio!r}; allowed: a positive number")
        self._numbers = (parameters.mechanics.mass, float(damping_ratio), parameters.electronics.control_period)
        self._offset: Array = np.empty((4, 0))

    def reset(self, lanes: Mask | None = None) -> None:
        """Start anew on the target: all lanes, or those where ``lanes`` (N,) is True."""
        if lanes is None:
            self._offset = np.empty((4, 0))
        elif self._offset.shape[1]:
            self._fresh[lanes] = 1.0

    def update(self, measurement: Measurement, reference: Reference) -> Array:
        """Where the end effector should be now, (8, N): x, y and three derivatives, SI; the jerk without the force's rate.

        Called once per control period, with signals over N lanes. Raises ``ValueError`` for a stiffness that is not positive
        definite.
        """
        require_stiffness(reference, 0.0)
        lanes = reference.rows.shape[1]
        if self._offset.shape[1] != lanes:
            self._offset, self._fresh = np.zeros((4, lanes)), np.zeros(lanes)
        motion = np.empty((8, lanes))
        _update(self._offset, reference.rows, measurement.user_force, *self._numbers, self._fresh, motion)
        self._fresh[:] = 0.0
        return motion
