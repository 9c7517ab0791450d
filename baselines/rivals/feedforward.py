"""What the rivals know of the motion that they follow: where the pistons should be and the forces that this takes.

In the plane the point mass needs P = m (A + g) - Fu for the acceleration A of the motion; along the cylinders, with the
Jacobian (16) at the reference pose, F* = J^T P + Fext + Fv vd + fraction Fc sign(vd). The user's force cancels against the
part of A that the admittance owes to it, so that dF*/dt needs no rate of that force.
"""

from __future__ import annotations

import math

import numpy as np

from baselines.estimation.stages import MOTION, MOVING, OWN
from baselines.staged import LawStage
from birthsim_env.loop.rows import REFERENCE, SEEN, USER_FORCE
from birthsim_env.loop.stage import block, numbers
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array, parameter_column
from birthsim_env.physics.inverse_kinematics import piston_reference
from birthsim_env.physics.rig.parameters import Parameters

SIGN_WIDTH = 0.01
"""m/s; assumed: over this REFERENCE speed the Coulomb feedforward goes from rest to sliding, slowly enough for the valves."""

WANTED = OWN
"""Where the pistons should be: y1, y2 (m) and three derivatives."""
NEEDED = WANTED + 8
FORCE1, FORCE2, RATE1, RATE2, KAPPA = range(5)
"""What the motion needs, in rows from ``NEEDED`` on: F* (N) and dF*/dt (N/s) of cylinders 1 and 2, and kappa, all at the
reference pose."""
END = NEEDED + 5


@helper
def friction_ahead(speed: float, acceleration: float, coulomb: float, viscous: float) -> tuple[float, float]:
    """Fc vd / sqrt(vd^2 + width^2) + Fv vd, N, and its rate, N/s."""
    square = speed * speed + SIGN_WIDTH * SIGN_WIDTH
    root = math.sqrt(square)
    slope = coulomb * SIGN_WIDTH * SIGN_WIDTH / (square * root) + viscous
    return coulomb * speed / root + viscous * speed, slope * acceleration


@helper
def needed_forces(wanted: Array, motion: Array, force: Array, p: Array, fraction: float, needed: Array, n: int) -> None:
    """Writes ``needed`` (5, n) for the motion (8, n), its pistons ``wanted`` (8, n) and the user's force (2, n)."""
    for i in range(n):
        v1, v2 = wanted[2, i], wanted[3, i]
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            wanted[0, i], wanted[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        m = p[at.MASS]
        px, py = m * motion[4, i] - force[0, i], m * (motion[5, i] + p[at.GRAVITY]) - force[1, i]
        jx, jy = m * motion[6, i], m * motion[7, i]
        along, across = sine * px - cosine * py, -cosine * px - sine * py
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + 2.0 * r4 * w / s2 * v1
        along_rate = sine * jx - cosine * jy - turn * across
        across_rate = -cosine * jx - sine * jy + turn * along
        drag1, drag1_rate = friction_ahead(v1, wanted[4, i], fraction * p[at.FC1], p[at.FV1])
        drag2, drag2_rate = friction_ahead(v2, wanted[5, i], fraction * p[at.FC2], p[at.FV2])
        needed[FORCE1, i] = kappa * across + p[at.ATMOSPHERE] * (p[at.AREA_P1] - p[at.AREA_N1]) + drag1
        needed[FORCE2, i] = along + p[at.ATMOSPHERE] * (p[at.AREA_P2] - p[at.AREA_N2]) + drag2
        needed[RATE1, i] = kappa * (across_rate + growth * across) + drag1_rate
        needed[RATE2, i] = along_rate + drag2_rate
        needed[KAPPA, i] = kappa


FRACTION, RIG = 0, 1
"""Constants of the stage: how much of the Coulomb friction is fed forward. The rig follows."""


@kernel
def _look_ahead(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    s, about = block(seen, SEEN), numbers(constants, RIG + PARAMETERS)
    p, motion, wanted = about[RIG:], s[MOTION:MOVING], s[WANTED:NEEDED]
    piston_reference(motion, p, wanted, n)
    needed_forces(wanted, motion, s[USER_FORCE:REFERENCE], p, about[FRACTION], s[NEEDED:END], n)
    return 0


def feedforward(rig: Parameters, fraction: float) -> LawStage:
    """Finds ``WANTED`` and ``NEEDED`` of the motion, with a ``fraction`` of the Coulomb friction that is believed."""
    return LawStage(_look_ahead, np.array([fraction, *parameter_column(rig)]), np.zeros(0))
