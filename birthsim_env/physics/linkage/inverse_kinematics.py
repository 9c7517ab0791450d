"""Inverse geometry with its first three time derivatives, for kernels: from Cartesian motion to motion of the pistons.

With P, V, A, J the end effector's position to jerk: r2^2 = P.P and theta1 = atan2(x, -y) give, differentiated,
    r2 r2' = P.V,  r2 r2'' = V.V + P.A - r2'^2,  r2 r2''' = 3 V.A + P.J - 3 r2' r2''
    r2^2 t' = h,   r2^2 t'' = h' - 2 r2 r2' t',  r2^2 t''' = h'' - 4 r2 r2' t'' - 2 (r2'^2 + r2 r2'') t',  h = x vy - y vx
and r4^2 = d3^2 + d6^2 + 2 d3 d6 sin(gamma3 - theta1) gives r4 in the same way.
"""

import math

from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.linkage import geometry


@helper
def piston_motion(motion: Array, p: Rig, joints: Array, n: int) -> None:
    """Writes y1, y2, v1, v2 (4, n) for the end effector's x, y, vx, vy (4, n) of one rig."""
    for i in range(n):
        x, y = motion[0, i], motion[1, i]
        vx, vy = motion[2, i], motion[3, i]
        r2 = math.sqrt(x * x + y * y)
        sine, cosine = x / r2, -y / r2
        r4 = geometry.length_r4(sine, cosine, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3)
        cos_alpha = p.cos_gamma3 * cosine + p.sin_gamma3 * sine
        joints[0, i] = r4 - p.k1
        joints[1, i] = r2 - p.k2
        joints[2, i] = -0.5 * p.d_product * cos_alpha * (x * vy - y * vx) / (r2 * r2) / r4
        joints[3, i] = (x * vx + y * vy) / r2


@kernel
def pistons_at(motion: Array, p: Rig, joints: Array) -> None:
    """``piston_motion`` of N lanes: ``motion`` and ``joints`` (4, N), one rig."""
    piston_motion(motion, p, joints, motion.shape[1])


@helper
def piston_reference(target: Array, p: Rig, joints: Array, n: int) -> None:
    """Writes y1, y2, v1, v2, a1, a2, j1, j2 (8, n) for a target's x, y to jx, jy (rows 0-7, n)."""
    for i in range(n):
        x, y = target[0, i], target[1, i]
        vx, vy = target[2, i], target[3, i]
        ax, ay = target[4, i], target[5, i]
        jx, jy = target[6, i], target[7, i]
        r2 = math.sqrt(x * x + y * y)
        sine, cosine = x / r2, -y / r2
        v2 = (x * vx + y * vy) / r2
        a2 = (vx * vx + vy * vy + x * ax + y * ay - v2 * v2) / r2
        j2 = (3.0 * (vx * ax + vy * ay) + x * jx + y * jy - 3.0 * v2 * a2) / r2
        square = r2 * r2
        t1 = (x * vy - y * vx) / square
        t2 = (x * ay - y * ax - 2.0 * r2 * v2 * t1) / square
        moment = vx * ay - vy * ax + x * jy - y * jx
        t3 = (moment - 4.0 * r2 * v2 * t2 - 2.0 * (v2 * v2 + r2 * a2) * t1) / square

        r4 = geometry.length_r4(sine, cosine, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3)
        half = 0.5 * p.d_product
        sin_alpha = p.sin_gamma3 * cosine - p.cos_gamma3 * sine
        cos_alpha = p.cos_gamma3 * cosine + p.sin_gamma3 * sine
        v1 = -half * cos_alpha * t1 / r4
        a1 = (-half * (sin_alpha * t1 * t1 + cos_alpha * t2) - v1 * v1) / r4
        third = -cos_alpha * t1 * t1 * t1 + 3.0 * sin_alpha * t1 * t2 + cos_alpha * t3
        j1 = (-half * third - 3.0 * v1 * a1) / r4
        joints[0, i], joints[1, i] = r4 - p.k1, r2 - p.k2
        joints[2, i], joints[3, i] = v1, v2
        joints[4, i], joints[5, i] = a1, a2
        joints[6, i], joints[7, i] = j1, j2
