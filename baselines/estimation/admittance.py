"""The motion that a hand should find: a Cartesian mass, damper and spring about the target, driven by the measured force.

    m (xr'' - xt'') + B (xr' - xt') + K (xr - xt) = Fu,   B = 2 zeta (m K)^(1/2)

with the full symmetric stiffness matrix K. At rest it stands on the compliant target (19); a controller that follows it renders
K, whatever its own stiffness. The mass is the rig's own, so that the hand feels no other inertia than what it moves anyway.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array

DAMPING_RATIO = 0.9
"""assumed: hardly any overshoot, and no slower than the rig needs to be."""

MOVING_SPEED = 1e-3
"""m/s; assumed: a slower reference lets the pistons rest."""


@helper
def square_root(xx: float, yy: float, xy: float) -> tuple[float, float, float]:
    """Square root of the symmetric positive definite matrix [[xx, xy], [xy, yy]]: its entries xx, yy, xy."""
    root = math.sqrt(xx * yy - xy * xy)
    trace = math.sqrt(xx + yy + 2.0 * root)
    return (xx + root) / trace, (yy + root) / trace, xy / trace


@helper
def damping(kxx: float, kyy: float, kxy: float, ratio: float) -> tuple[float, float, float]:
    """B/m, 1/s, of the spring K/m (1/s2): entries xx, yy, xy."""
    bxx, byy, bxy = square_root(kxx, kyy, kxy)
    return 2.0 * ratio * bxx, 2.0 * ratio * byy, 2.0 * ratio * bxy


@helper
def is_stiffer(kxx: float, kyy: float, kxy: float, least: float) -> bool:
    """Whether the stiffness [[kxx, kxy], [kxy, kyy]] is more than ``least`` in every direction, N/m."""
    return kxx > least and (kxx - least) * (kyy - least) - kxy * kxy > 0.0


@helper
def derivatives(
    offset: Array, i: int, fx: float, fy: float, kxx: float, kyy: float, kxy: float, bxx: float, byy: float, bxy: float
) -> tuple[float, float, float, float]:
    """Acceleration and jerk of the offset (4, N) of lane ``i`` under a held force; all over the mass."""
    # The rate of the force is left out here, and by whoever follows, for whom the two cancel.
    x, y, vx, vy = offset[0, i], offset[1, i], offset[2, i], offset[3, i]
    ax, ay = fx - bxx * vx - bxy * vy - kxx * x - kxy * y, fy - bxy * vx - byy * vy - kxy * x - kyy * y
    jx, jy = -bxx * ax - bxy * ay - kxx * vx - kxy * vy, -bxy * ax - byy * ay - kxy * vx - kyy * vy
    return ax, ay, jx, jy


@helper
def advance(
    offset: Array, i: int, period: float, ax: float, ay: float, jx: float, jy: float,
    kxx: float, kyy: float, kxy: float, bxx: float, byy: float, bxy: float,
) -> None:  # fmt: skip
    """Carries the offset (4, N) of lane ``i`` on by one period."""
    vx, vy = offset[2, i], offset[3, i]
    sx, sy = -bxx * jx - bxy * jy - kxx * ax - kxy * ay, -bxy * jx - byy * jy - kxy * ax - kyy * ay
    # Taylor's series to the third order: the system is linear and w x period is below 0.06.
    offset[0, i] += period * (vx + period * (ax / 2.0 + period * jx / 6.0))
    offset[1, i] += period * (vy + period * (ay / 2.0 + period * jy / 6.0))
    offset[2, i] += period * (ax + period * (jx / 2.0 + period * sx / 6.0))
    offset[3, i] += period * (ay + period * (jy / 2.0 + period * sy / 6.0))


@helper
def give_way(
    offset: Array, reference: Array, force: Array, mass: float, ratio: float, period: float, factor: Array, motion: Array
) -> None:  # fmt: skip
    """``offset`` (4, N): xr - xt and its rate, zero at a new start, carried on by one period; ``factor`` (N,) of the
    damping, at least 1. ``motion`` (8, N)."""
    for i in range(offset.shape[1]):
        kxx, kyy, kxy = reference[8, i] / mass, reference[9, i] / mass, reference[14, i] / mass
        bxx, byy, bxy = damping(kxx, kyy, kxy, ratio * max(1.0, factor[i]))
        ax, ay, jx, jy = derivatives(offset, i, force[0, i] / mass, force[1, i] / mass, kxx, kyy, kxy, bxx, byy, bxy)
        motion[0, i], motion[1, i] = reference[0, i] + offset[0, i], reference[1, i] + offset[1, i]
        motion[2, i], motion[3, i] = reference[2, i] + offset[2, i], reference[3, i] + offset[3, i]
        motion[4, i], motion[5, i] = reference[4, i] + ax, reference[5, i] + ay
        motion[6, i], motion[7, i] = reference[6, i] + jx, reference[7, i] + jy
        advance(offset, i, period, ax, ay, jx, jy, kxx, kyy, kxy, bxx, byy, bxy)


@helper
def mark_moving(motion: Array, moving: Array) -> None:
    """``moving`` (N,) gets 1 where the velocity of ``motion`` (4 or more, N), m/s, is above ``MOVING_SPEED``, else 0."""
    for i in range(motion.shape[1]):
        moving[i] = 1.0 if motion[2, i] * motion[2, i] + motion[3, i] * motion[3, i] > MOVING_SPEED * MOVING_SPEED else 0.0


@kernel
def forecast(
    offset: Array, reference: Array, force: Array, mass: float, ratio: float, period: float, ticks: NDArray[np.int64],
    ahead: Array,
) -> None:  # fmt: skip
    """Writes ``ahead`` (M, 4, N): x, y (m), vx, vy (m/s) of the motion ``ticks`` (M,) periods from now, if nothing new happens.

    The force (2, N) and the stiffness stay, and the target goes on with the jerk that it has. ``offset`` (4, N) is that of one
    period from now, as ``give_way`` leaves it; ``ticks`` are increasing whole numbers from 1 on.
    """
    z = offset.copy()
    for i in range(offset.shape[1]):
        kxx, kyy, kxy = reference[8, i] / mass, reference[9, i] / mass, reference[14, i] / mass
        bxx, byy, bxy = damping(kxx, kyy, kxy, ratio)
        tick = 1
        for k in range(len(ticks)):
            while tick < ticks[k]:
                ax, ay, jx, jy = derivatives(z, i, force[0, i] / mass, force[1, i] / mass, kxx, kyy, kxy, bxx, byy, bxy)
                advance(z, i, period, ax, ay, jx, jy, kxx, kyy, kxy, bxx, byy, bxy)
                tick += 1
            t = tick * period
            for axis in range(2):
                v, a, j = reference[2 + axis, i], reference[4 + axis, i], reference[6 + axis, i]
                ahead[k, axis, i] = reference[axis, i] + t * (v + t * (a / 2.0 + t * j / 6.0)) + z[axis, i]
                ahead[k, 2 + axis, i] = v + t * (a + t * j / 2.0) + z[2 + axis, i]
