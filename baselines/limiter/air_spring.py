"""The rig as an air spring about its target: what the valves are led to where a law may not act.

Valves that shut lock in the pressures of that moment. These balance neither weight nor hand, and the rig moves to where they
do, which gives a hand 0.1 J and more. So the valves give each chamber the air with which the rig alone would rest at its
target. A chamber's air is judged by pressure times length, at the time at which the position was taken. The product does not
depend on how the rig moves, so the valves do not excite what they hold. A rig of constant air is a spring that friction damps.

The forces of the chambers that balance the weight are those of now and the hand's share, averaged over ``MEMORY``: over an
oscillation the acceleration averages to nothing.
"""

from __future__ import annotations

import math

import numpy as np

from baselines.valve_inverse import openings_for_flows
from birthsim_env.loop.signals import InPlane, Joints, Mask, Measurement, PerPiston, Reference
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters

RETURN = 0.02
"""s, time constant with which the air comes back; assumed, some times the valves' own."""

MEMORY = 1.0
"""s, assumed: longer than a period of the softest oscillation, shorter than a rig's load changes."""

_OUTWARD = np.array([[1.0], [-1.0], [1.0], [-1.0]])
"""Sign of a chamber's force, and of its length's growth with the piston's position, of P1, N1, P2, N2."""


@kernel
def _along(force: InPlane, joints: Joints, p: Rig, along: PerPiston) -> None:
    for i in range(force.x.shape[0]):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product,
            p.sin_gamma3, p.cos_gamma3,
        )  # fmt: skip
        along.first[i] = mechanics.user_force1(force.x[i], force.y[i], kappa, sine, cosine)
        along.second[i] = mechanics.user_force2(force.x[i], force.y[i], sine, cosine)


class AirSpring:
    """N lanes of a rig with ``parameters``; ``openings`` is called once per control period."""

    def __init__(self, parameters: Parameters, lanes: int) -> None:
        p = self._p = parameter_column(parameters)
        self._rate = -math.expm1(-parameters.electronics.control_period / MEMORY)
        self._areas = p[[at.AREA_P1, at.AREA_N1, at.AREA_P2, at.AREA_N2], None]
        self._middle = p[[at.HALF_L1, at.HALF_L1, at.HALF_L2, at.HALF_L2], None] + p[at.DEAD_VOLUME] / self._areas
        self._forces: Array = np.full((4, lanes), np.nan)

    def reset(self, lanes: Mask) -> None:
        """Forget the balance of the lanes of a mask (N,): what comes next counts as one."""
        self._forces[:, lanes] = np.nan

    def openings(self, position: Array, pressures: Array, hand: Array, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings (4, N) at the signals of now; ``position`` (2, N), m, was taken when the ``pressures`` were (4, N),
        Pa, and the ``hand``'s force (2, N), N."""
        (joints, here), (_, there) = self._lengths(position), self._lengths(reference.position)
        forces, along = pressures * self._areas, np.empty_like(hand)
        _along(InPlane(np.ascontiguousarray(hand)), joints, Rig(self._p), PerPiston(along))
        stroke = np.repeat(here[::2] + here[1::2], 2, axis=0)
        balanced = forces + _OUTWARD * np.repeat(along, 2, axis=0) * here / stroke
        self._forces = np.where(np.isnan(self._forces), balanced, self._forces)
        self._forces += self._rate * (balanced - self._forces)
        flows = (self._forces * there - forces * here) / (RETURN * self._p[at.GAS] * self._p[at.TEMPERATURE])
        return openings_for_flows(flows, measurement.pressures, self._p)

    def _lengths(self, position: Array) -> tuple[Joints, Array]:
        """Pistons, which stand still, and lengths of the chambers, dead volumes included, m, (4, N)."""
        joints = Joints(np.empty((Joints.size, position.shape[1])))
        pistons_at(np.concatenate([position, np.zeros_like(position)]), Rig(self._p), joints.rows)
        return joints, self._middle + _OUTWARD * np.repeat(joints.position, 2, axis=0)
