"""What accelerates the pistons without being known, from measured speeds.

    v' = f + g (F + Fu + believed) + d + 2 w (v_measured - v),   d' = w^2 (v_measured - v)

At rest d takes up friction and the model's errors, so that the force follows the position error without them: the integral of
the compliance error in disguise.
"""

from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from birthsim_env.loop.signals import Joints, PerChamber, Point
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion


@helper
def accelerations(joints: Joints, i: int, pressures: Array, inputs: Inputs, p: Rig) -> tuple[float, float, float]:
    """What pressures (4, N) and forces explain of the pistons' accelerations in lane ``i``, m/s2; and kappa."""
    y1, y2 = joints.position[0, i], joints.position[1, i]
    v1, v2 = joints.speed[0, i], joints.speed[1, i]
    r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
        y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
    )
    force, believed, air = inputs.force, inputs.believed, PerChamber(pressures)
    load1 = (
        mechanics.piston_force(air.p1[i], air.n1[i], p.area_p1, p.area_n1, p.atmosphere)
        - p.fv1 * v1
        + mechanics.user_force1(force[0, i], force[1, i], kappa, sine, cosine)
        + believed[0, i]
    )
    load2 = (
        mechanics.piston_force(air.p2[i], air.n2[i], p.area_p2, p.area_n2, p.atmosphere)
        - p.fv2 * v2
        + mechanics.user_force2(force[0, i], force[1, i], sine, cosine)
        + believed[1, i]
    )
    inverse_mass = inputs.inverse_mass[i]
    a1 = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, inverse_mass, p.gravity)
    return a1, mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, inverse_mass, p.gravity), kappa


@helper
def observe(
    pistons: Pistons, point: Point, pressures: Array, inputs: Inputs, assumed: AssumedParameters, joints: Joints, n: int
) -> None:
    """Carries speed and disturbance of n ``pistons`` on by one control period; writes ``joints`` for the measured ``point``."""
    p, period, bandwidth = assumed.rig, assumed.period, assumed.bandwidth
    speed, disturbance = pistons.speed, pistons.disturbance
    piston_motion(point.rows, p, joints.rows, n)
    for i in range(n):
        v1, v2 = joints.speed[0, i], joints.speed[1, i]
        if pistons.fresh[i] > 0.0:
            speed[0, i], speed[1, i], disturbance[0, i] = v1, v2, 0.0
            disturbance[1, i], pistons.fresh[i] = 0.0, 0.0
        a1, a2, _ = accelerations(joints, i, pressures, inputs, p)
        off1, off2 = v1 - speed[0, i], v2 - speed[1, i]
        speed[0, i] += period * (a1 + disturbance[0, i] + 2.0 * bandwidth * off1)
        speed[1, i] += period * (a2 + disturbance[1, i] + 2.0 * bandwidth * off2)
        disturbance[0, i] += period * bandwidth * bandwidth * off1
        disturbance[1, i] += period * bandwidth * bandwidth * off2
