"""What the rivals know of the motion that they follow: where the pistons should be and the forces that this takes.

In the plane the point mass needs P = m (A + g) - Fu for the acceleration A of the motion; along the cylinders, with the
Jacobian (16) at the reference pose, F* = J^T P + Fext + Fv vd + fraction Fc sign(vd). The user's force cancels against the
part of A that the admittance owes to it, so that dF*/dt needs no rate of that force.
"""

import math

import numpy as np

from baselines.backstepping.law import JointReference
from baselines.estimation import dry_friction
from baselines.estimation.stages import PistonEstimate
from baselines.staged import ControllerStage
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import InPlane
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.linkage.inverse_kinematics import piston_reference
from birthsim_env.physics.rig.parameters import Parameters

SIGN_WIDTH = 0.01
"""m/s; assumed: over this REFERENCE speed the Coulomb feedforward goes from rest to sliding, slowly enough for the valves."""


class RequiredForce(Rows):
    """What the motion needs, at the reference pose."""

    force = rows("F1 F2", "N", "F*")
    rate = rows("dF1 dF2", "N/s", "dF*/dt")
    kappa = row("1", "amplification of cylinder 1")


class Tracking(PistonEstimate):
    """What the stages before a law hand on."""

    wanted = part(JointReference, "where the pistons should be")
    needed = part(RequiredForce, "forces")


@helper
def friction_ahead(speed: float, acceleration: float, coulomb: float, viscous: float) -> tuple[float, float]:
    """Fc vd / sqrt(vd^2 + width^2) + Fv vd, N, and its rate, N/s."""
    square = speed * speed + SIGN_WIDTH * SIGN_WIDTH
    root = math.sqrt(square)
    slope = coulomb * SIGN_WIDTH * SIGN_WIDTH / (square * root) + viscous
    return coulomb * speed / root + viscous * speed, slope * acceleration


@helper
def needed_forces(tracked: Tracking, hand: Array, pressures: Array, p: Rig, fraction: float, n: int) -> None:
    """Writes what is needed for the motion and its pistons, while the ``hand`` pushes with (2, N), N, and the chambers are at
    ``pressures`` (4, N), Pa."""
    wanted, motion, needed, push = tracked.wanted, tracked.motion, tracked.needed, InPlane(hand)
    for i in range(n):
        y1, y2, v1, v2 = wanted.position[0, i], wanted.position[1, i], wanted.speed[0, i], wanted.speed[1, i]
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        m = p.mass
        ax, ay, jx, jy = motion.acceleration[0, i], motion.acceleration[1, i], m * motion.jerk[0, i], m * motion.jerk[1, i]
        px, py = m * ax - push.x[i], m * (ay + p.gravity) - push.y[i]
        along, across = sine * px - cosine * py, -cosine * px - sine * py
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + 2.0 * r4 * w / s2 * v1
        along_rate = sine * jx - cosine * jy - turn * across
        across_rate = -cosine * jx - sine * jy + turn * along
        fc1, fc2 = dry_friction.level_moving(0, v1, pressures, i, p), dry_friction.level_moving(1, v2, pressures, i, p)
        drag1, drag1_rate = friction_ahead(v1, wanted.acceleration[0, i], fraction * fc1, p.fv1)
        drag2, drag2_rate = friction_ahead(v2, wanted.acceleration[1, i], fraction * fc2, p.fv2)
        needed.force[0, i] = kappa * across + p.atmosphere * (p.area_p1 - p.area_n1) + drag1
        needed.force[1, i] = along + p.atmosphere * (p.area_p2 - p.area_n2) + drag2
        needed.rate[0, i] = kappa * (across_rate + growth * across) + drag1_rate
        needed.rate[1, i] = along_rate + drag2_rate
        needed.kappa[i] = kappa


class Constants(Numbers):
    """Of the stage."""

    fraction = number("1", "how much of the Coulomb friction is fed forward")
    rig = part(Rig, "the rig as described")


@kernel
def _look_ahead(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    tracked = Tracking(seen.intermediate[: Tracking.size])
    piston_reference(tracked.motion.rows, constants.rig, tracked.wanted.rows, n)
    needed_forces(tracked, seen.user_force, seen.pressure, constants.rig, constants.fraction, n)
    return 0


def feedforward(rig: Parameters, fraction: float) -> ControllerStage:
    """Finds what ``Tracking`` adds of the motion, with a ``fraction`` of the Coulomb friction that is believed."""
    return ControllerStage(_look_ahead, Constants.numbers(fraction=fraction, rig=parameter_column(rig)), np.zeros(0))
