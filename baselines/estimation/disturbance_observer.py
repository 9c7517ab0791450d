"""What accelerates the pistons without being known, from measured speeds.

    v' = f + g (F + Fu + believed) + d + 2 w (v_measured - v),   d' = w^2 (v_measured - v)

At rest d takes up friction and the model's errors, so that the force follows the position error without them: the integral of
the compliance error in disguise.
"""

from __future__ import annotations

from birthsim_env.loop.stage import scratch
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion


@helper
def accelerations(
    y1: float, y2: float, v1: float, v2: float, i: int, pressures: Array, force: Array, believed: Array, p: Array
) -> tuple[float, float, float]:
    """What pressures (4, N), the user's ``force`` (2, N) and forces ``believed`` (2, N) along the pistons explain of the
    pistons' accelerations in lane ``i``, m/s2; and kappa."""
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
    return a1, mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS], p[at.GRAVITY]), kappa


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
        a1, a2, _ = accelerations(y1, y2, v1, v2, i, pressures, force, believed, p)
        off1, off2 = v1 - estimate[0, i], v2 - estimate[1, i]
        estimate[0, i] += period * (a1 + estimate[2, i] + 2.0 * bandwidth * off1)
        estimate[1, i] += period * (a2 + estimate[3, i] + 2.0 * bandwidth * off2)
        estimate[2, i] += period * bandwidth * bandwidth * off1
        estimate[3, i] += period * bandwidth * bandwidth * off2
