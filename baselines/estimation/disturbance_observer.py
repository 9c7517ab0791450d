"""What accelerates the pistons without being known, from measured speeds.

    v' = f + g (F + Fu + believed) + d + 2 w (v_measured - v),   d' = w^2 (v_measured - v)

At rest d takes up friction and the model's errors, so that the force follows the position error without them: the integral of
the compliance error in disguise.
"""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.signals import Mask, Measurement
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion


@helper
def observe(
    estimate: Array, position: Array, velocity: Array, pressures: Array, force: Array, believed: Array, p: Array,
    period: float, bandwidth: float, fresh: Array, joints: Array,
) -> None:  # fmt: skip
    """One control period. ``estimate`` (4, N): v1, v2, d1, d2; ``joints`` (4, N) gets y1, y2, v1, v2 as measured."""
    motion, one = scratch(4), scratch(4)
    for i in range(estimate.shape[1]):
        motion[0, 0], motion[1, 0], motion[2, 0], motion[3, 0] = position[0, i], position[1, i], velocity[0, i], velocity[1, i]
        piston_motion(motion, p, one, 1)
        y1, y2, v1, v2 = one[0, 0], one[1, 0], one[2, 0], one[3, 0]
        joints[0, i], joints[1, i], joints[2, i], joints[3, i] = y1, y2, v1, v2
        if fresh[i] > 0.0:
            estimate[0, i], estimate[1, i], estimate[2, i], estimate[3, i] = v1, v2, 0.0, 0.0
        r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        load1 = (
            mechanics.piston_force(pressures[0, i], pressures[1, i], p[at.AREA_P1], p[at.AREA_N1], p[at.ATMOSPHERE])
            - p[at.FV1] * v1
            + mechanics.user_force1(force[0, i], force[1, i], kappa, sine, cosine)
            + believed[0, i]
        )
        load2 = (
            mechanics.piston_force(pressures[2, i], pressures[3, i], p[at.AREA_P2], p[at.AREA_N2], p[at.ATMOSPHERE])
            - p[at.FV2] * v2
            + mechanics.user_force2(force[0, i], force[1, i], sine, cosine)
            + believed[1, i]
        )
        a1 = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS], p[at.GRAVITY])
        a2 = mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS], p[at.GRAVITY])
        off1, off2 = v1 - estimate[0, i], v2 - estimate[1, i]
        estimate[0, i] += period * (a1 + estimate[2, i] + 2.0 * bandwidth * off1)
        estimate[1, i] += period * (a2 + estimate[3, i] + 2.0 * bandwidth * off2)
        estimate[2, i] += period * bandwidth * bandwidth * off1
        estimate[3, i] += period * bandwidth * bandwidth * off2


class DisturbanceObserver:
    """``disturbance`` (2, N), m/s2, along the pistons, from measured positions, speeds, pressures and user forces.

    Arguments: the rig's control ``period``, s, its parameters (PARAMETERS,), and the ``bandwidth`` w, 1/s.
    """

    def __init__(self, period: float, lane_parameters: Array, bandwidth: float) -> None:
        self._period, self._p, self._bandwidth = period, lane_parameters, bandwidth
        self._estimate: Array = np.empty((4, 0))

    @property
    def disturbance(self) -> Array:
        """d of both pistons, m/s2, (2, N)."""
        return self._estimate[2:4]

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if lanes is None:
            self._estimate = np.empty((4, 0))
        elif self._estimate.shape[1]:
            self._fresh[lanes] = 1.0

    def update(self, measurement: Measurement, force: Array, believed: Array) -> Array:
        """Take one control period's measurement and return y1, y2, v1, v2 as measured, (4, N).

        ``force`` (2, N), N, is the user's; ``believed`` (2, N), N, acts along the pistons besides.
        """
        lanes = measurement.position.shape[1]
        if self._estimate.shape[1] != lanes:
            self._estimate, self._fresh = np.zeros((4, lanes)), np.ones(lanes)
        joints = np.empty((4, lanes))
        observe(
            self._estimate, measurement.position, measurement.velocity, measurement.pressures, force, believed, self._p,
            self._period, self._bandwidth, self._fresh, joints,
        )  # fmt: skip
        self._fresh[:] = 0.0
        return joints
