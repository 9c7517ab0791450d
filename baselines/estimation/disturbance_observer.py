"""What accelerates the pistons without being known, from measured speeds.

    v' = f + g (F + Fu + believed) + d + 2 w (v_measured - v),   d' = w^2 (v_measured - v)

At rest d takes up friction and the model's errors, so that the force follows the position error without them: the integral of
the compliance error in disguise.
"""

from __future__ import annotations

from baselines.estimation.rows import Belief, Given, Pistons
from birthsim_env.loop.signals import Joints, PerChamber, Point
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion


@helper
def accelerations(joints: Joints, i: int, pressures: Array, given: Given, p: Array) -> tuple[float, float, float]:
    """What pressures (4, N) and forces explain of the pistons' accelerations in lane ``i``, m/s2; and kappa."""
    y1, y2, v1, v2 = joints.position[0, i], joints.position[1, i], joints.speed[0, i], joints.speed[1, i]
    r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
        y1, y2, p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
    )
    force, believed, air = given.force, given.believed, PerChamber(pressures)
    load1 = (
        mechanics.piston_force(air.p1[i], air.n1[i], p[at.AREA_P1], p[at.AREA_N1], p[at.ATMOSPHERE])
        - p[at.FV1] * v1
        + mechanics.user_force1(force[0, i], force[1, i], kappa, sine, cosine)
        + believed[0, i]
    )
    load2 = (
        mechanics.piston_force(air.p2[i], air.n2[i], p[at.AREA_P2], p[at.AREA_N2], p[at.ATMOSPHERE])
        - p[at.FV2] * v2
        + mechanics.user_force2(force[0, i], force[1, i], sine, cosine)
        + believed[1, i]
    )
    a1 = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS], p[at.GRAVITY])
    return a1, mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS], p[at.GRAVITY]), kappa


@helper
def observe(pistons: Pistons, point: Point, pressures: Array, given: Given, about: Belief, joints: Joints) -> None:
    """Carries speed and disturbance of ``pistons`` on by one control period; writes ``joints`` for the measured ``point``.

    N is at most that of a block.
    """
    p, period, bandwidth, speed, disturbance = about.rig, about.period, about.bandwidth, pistons.speed, pistons.disturbance
    piston_motion(point.rows, p, joints.rows, pistons.fresh.shape[0])
    for i in range(pistons.fresh.shape[0]):
        v1, v2 = joints.speed[0, i], joints.speed[1, i]
        if pistons.fresh[i] > 0.0:
            speed[0, i], speed[1, i], disturbance[0, i], disturbance[1, i], pistons.fresh[i] = v1, v2, 0.0, 0.0, 0.0
        a1, a2, _ = accelerations(joints, i, pressures, given, p)
        off1, off2 = v1 - speed[0, i], v2 - speed[1, i]
        speed[0, i] += period * (a1 + disturbance[0, i] + 2.0 * bandwidth * off1)
        speed[1, i] += period * (a2 + disturbance[1, i] + 2.0 * bandwidth * off2)
        disturbance[0, i] += period * bandwidth * bandwidth * off1
        disturbance[1, i] += period * bandwidth * bandwidth * off2
