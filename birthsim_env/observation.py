"""What a policy sees: one kernel computes it, one table names and scales every entry.

All entries come from measurements (noisy and late with ``lab`` sensors).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Measurement, Reference, compliance
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import control_model, geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion

LIMIT = 10.0
"""Bound of every observation entry, in units of its scale."""


@dataclass(frozen=True)
class Entry:
    """One entry of the observation: what it is, its unit and the value that maps to 1."""

    name: str
    unit: str
    scale: float

    def __str__(self) -> str:
        return f"{self.name}, {self.scale:g} {self.unit}"


ENTRIES = (
    Entry("tracking error x (end effector - compliant target)", "m", 0.01),
    Entry("tracking error y (end effector - compliant target)", "m", 0.01),
    Entry("end effector velocity x", "m/s", 0.2),
    Entry("end effector velocity y", "m/s", 0.2),
    Entry("piston position y1", "half strokes", 1.0),
    Entry("piston position y2", "half strokes", 1.0),
    Entry("force on piston 1 (F - Fext + user force (17))", "N", 200.0),
    Entry("force on piston 2 (F - Fext + user force (17))", "N", 200.0),
    Entry("pneumatic stiffness of cylinder 1", "N/m", 5000.0),
    Entry("pneumatic stiffness of cylinder 2", "N/m", 2500.0),
    Entry("pneumatic stiffness setpoint of cylinder 1", "N/m", 5000.0),
    Entry("pneumatic stiffness setpoint of cylinder 2", "N/m", 2500.0),
    Entry("closed-loop stiffness setpoint x", "N/m", 5000.0),
    Entry("closed-loop stiffness setpoint y", "N/m", 5000.0),
    Entry("user force x", "N", 50.0),
    Entry("user force y", "N", 50.0),
    Entry("target velocity x", "m/s", 0.2),
    Entry("target velocity y", "m/s", 0.2),
    Entry("target acceleration x", "m/s2", 0.5),
    Entry("target acceleration y", "m/s2", 0.5),
)
SIZE = len(ENTRIES)
SCALES = np.array([entry.scale for entry in ENTRIES])


@helper
def look(
    position: Array, velocity: Array, pressures: Array, reference: Array, force: Array, action: Array, shown: Array, p: Array,
    scales: Array, rows: NDArray[np.float32],
) -> None:  # fmt: skip
    """Writes observations, ``rows`` (N, SIZE + M + S), see ``observe``; then ``action`` (M, N), ``shown`` (S, N)."""
    motion, joints, seen = scratch(4), scratch(4), scratch(SIZE)[:, 0]
    for i in range(position.shape[1]):
        motion[0, 0], motion[1, 0] = position[0, i], position[1, i]
        motion[2, 0], motion[3, 0] = velocity[0, i], velocity[1, i]
        piston_motion(motion, p, joints, 1)
        y1, y2 = joints[0, 0], joints[1, 0]
        pp1, pn1, pp2, pn2 = pressures[0, i], pressures[1, i], pressures[2, i], pressures[3, i]
        half1, half2 = p[at.HALF_L1], p[at.HALF_L2]
        edge1, edge2 = 0.02 * half1, 0.02 * half2
        given = compliance(force[0, i], force[1, i], reference[8, i], reference[9, i], reference[14, i])
        for axis in range(2):
            seen[axis] = position[axis, i] - reference[axis, i] - given[axis]
            seen[2 + axis] = velocity[axis, i]
            seen[10 + axis] = reference[10 + axis, i]
            seen[12 + axis] = reference[8 + axis, i]
            seen[14 + axis] = force[axis, i]
            seen[16 + axis] = reference[2 + axis, i]
            seen[18 + axis] = reference[4 + axis, i]
        seen[4], seen[5] = y1 / half1, y2 / half2
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        # Pressures and hand together: what is left to hold them in balance is weight and friction, whatever the hand does.
        pressed1 = mechanics.piston_force(pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], p[at.ATMOSPHERE])
        pressed2 = mechanics.piston_force(pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], p[at.ATMOSPHERE])
        seen[6] = pressed1 + mechanics.user_force1(force[0, i], force[1, i], kappa, sine, cosine)
        seen[7] = pressed2 + mechanics.user_force2(force[0, i], force[1, i], sine, cosine)
        seen[8] = control_model.pneumatic_stiffness(
            pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], max(half1 + y1, edge1), max(half1 - y1, edge1), p[at.INDEX]
        )
        seen[9] = control_model.pneumatic_stiffness(
            pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], max(half2 + y2, edge2), max(half2 - y2, edge2), p[at.INDEX]
        )
        for k in range(scales.shape[0]):
            rows[i, k] = max(-LIMIT, min(LIMIT, seen[k] / scales[k]))
        for k in range(action.shape[0]):
            rows[i, scales.shape[0] + k] = action[k, i]
        for k in range(shown.shape[0]):
            rows[i, scales.shape[0] + action.shape[0] + k] = shown[k, i]


def observe(seen: Measurement, reference: Reference, beside: Array, nominal: Array) -> NDArray[np.float32]:
    """Observations (N, SIZE + M): ``ENTRIES`` over their scales, clipped to +-LIMIT, then what stands beside them.

    ``beside`` (M, N): the last action, and what an actuation remembers; ``nominal`` (PARAMETERS,) is the rig as its owner
    describes it: a policy does not know what randomisation drew.
    """
    rows = np.empty((seen.position.shape[1], SIZE + beside.shape[0]), dtype=np.float32)
    nothing = np.empty((0, beside.shape[1]))
    look(
        seen.position, seen.velocity, seen.pressures, reference.rows, seen.user_force, beside, nothing, nominal, SCALES, rows
    )  # fmt: skip
    return rows
