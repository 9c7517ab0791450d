"""The motion that a hand should find: a Cartesian mass, damper and spring about the target, driven by the measured force.

    m (xr'' - xt'') + B (xr' - xt') + K (xr - xt) = Fu,   B = 2 zeta (m K)^(1/2)

with the full symmetric stiffness matrix K. At rest it stands on the compliant target (19); a controller that follows it renders
K, whatever its own stiffness. The mass is the rig's own, so that the hand feels no other inertia than what it moves anyway.
"""

import math
from typing import NamedTuple

from birthsim_env.loop.signals import InPlane, Motion, Point, Reference
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, number

DAMPING_RATIO = 0.9
"""assumed: hardly any overshoot, and no slower than the rig needs to be."""

MOVING_SPEED = 1e-3
"""m/s; assumed: a slower reference lets the pistons rest."""


class Compliance(Numbers):
    """What gives way."""

    mass = number("kg", "mass")
    damping_ratio = number("1", "damping ratio zeta")
    period = number("s", "control period")


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


class Spring(NamedTuple):
    """Stiffness (1/s2) and damping (1/s), all over the mass: entries xx, yy, xy."""

    kxx: float
    kyy: float
    kxy: float
    bxx: float
    byy: float
    bxy: float


@helper
def spring_of(asked: Reference, i: int, mass: float, ratio: float) -> Spring:
    """The spring of lane ``i`` with a damping ``ratio``."""
    kxx, kyy, kxy = asked.stiffness[0, i] / mass, asked.stiffness[1, i] / mass, asked.stiffness_coupling[i] / mass
    bxx, byy, bxy = damping(kxx, kyy, kxy, ratio)
    return Spring(kxx, kyy, kxy, bxx, byy, bxy)


@helper
def derivatives(offset: Point, i: int, fx: float, fy: float, s: Spring) -> tuple[float, float, float, float]:
    """Acceleration and jerk of the offset of lane ``i`` under a held force over the mass."""
    # The rate of the force is left out here, and by whoever follows, for whom the two cancel.
    x, y = offset.position[0, i], offset.position[1, i]
    vx, vy = offset.velocity[0, i], offset.velocity[1, i]
    ax, ay = fx - s.bxx * vx - s.bxy * vy - s.kxx * x - s.kxy * y, fy - s.bxy * vx - s.byy * vy - s.kxy * x - s.kyy * y
    jx, jy = -s.bxx * ax - s.bxy * ay - s.kxx * vx - s.kxy * vy, -s.bxy * ax - s.byy * ay - s.kxy * vx - s.kyy * vy
    return ax, ay, jx, jy


@helper
def advance(offset: Point, i: int, period: float, rates: tuple[float, float, float, float], s: Spring) -> None:
    """Carries the offset of lane ``i`` on by one period with its ``derivatives``."""
    (ax, ay, jx, jy), vx, vy = rates, offset.velocity[0, i], offset.velocity[1, i]
    sx, sy = -s.bxx * jx - s.bxy * jy - s.kxx * ax - s.kxy * ay, -s.bxy * jx - s.byy * jy - s.kxy * ax - s.kyy * ay
    # Taylor's series to the third order: the system is linear and w x period is below 0.06.
    offset.position[0, i] += period * (vx + period * (ax / 2.0 + period * jx / 6.0))
    offset.position[1, i] += period * (vy + period * (ay / 2.0 + period * jy / 6.0))
    offset.velocity[0, i] += period * (ax + period * (jx / 2.0 + period * sx / 6.0))
    offset.velocity[1, i] += period * (ay + period * (jy / 2.0 + period * sy / 6.0))


@helper
def update_motion(
    offset: Point, asked: Reference, force: Array, constants: Compliance, factor: Array, heavier: Array, motion: Motion
) -> int:
    """Writes ``motion`` and carries ``offset`` on by one period; returns how many setpoints are not positive definite.

    ``force`` (2, N), N, is the hand's; ``factor`` (N,) multiplies the damping where it is more than 1, and ``heavier`` (N,)
    the mass.
    """
    missed, push = 0, InPlane(force)
    for i in range(factor.shape[0]):
        stiffer = is_stiffer(asked.stiffness[0, i], asked.stiffness[1, i], asked.stiffness_coupling[i], 0.0)
        missed += 0 if stiffer else 1
    for i in range(factor.shape[0]):
        mass = constants.mass * heavier[i]
        spring = spring_of(asked, i, mass, constants.damping_ratio * max(1.0, factor[i]))
        ax, ay, jx, jy = derivatives(offset, i, push.x[i] / mass, push.y[i] / mass, spring)
        for axis in range(2):
            motion.position[axis, i] = asked.position[axis, i] + offset.position[axis, i]
            motion.velocity[axis, i] = asked.velocity[axis, i] + offset.velocity[axis, i]
        motion.acceleration[0, i], motion.acceleration[1, i] = asked.acceleration[0, i] + ax, asked.acceleration[1, i] + ay
        motion.jerk[0, i], motion.jerk[1, i] = asked.jerk[0, i] + jx, asked.jerk[1, i] + jy
        advance(offset, i, constants.period, (ax, ay, jx, jy), spring)
    return missed


@helper
def goes(vx: float, vy: float) -> float:
    """1 at a velocity, m/s, above ``MOVING_SPEED``, else 0."""
    return 1.0 if vx * vx + vy * vy > MOVING_SPEED * MOVING_SPEED else 0.0


@helper
def mark_moving(motion: Motion, moving: Array) -> None:
    """``moving`` (N,) gets 1 where the velocity of ``motion``, m/s, is above ``MOVING_SPEED``, else 0."""
    for i in range(moving.shape[0]):
        moving[i] = goes(motion.velocity[0, i], motion.velocity[1, i])


@helper
def forecast(offset: Point, asked: Reference, force: Array, constants: Compliance, ticks: Array, ahead: Array) -> None:
    """Writes ``ahead`` (4 M, N): x, y (m), vx, vy (m/s) of the motion ``ticks`` (M,) periods from now, if nothing new happens.

    The force (2, N) and the stiffness stay, and the target goes on with the jerk that it has. ``offset`` is that of one period
    from now, as ``update_motion`` leaves it, and is carried on; ``ticks`` are increasing whole numbers from 1 on.
    """
    mass, period, push = constants.mass, constants.period, InPlane(force)
    for i in range(force.shape[1]):
        spring, tick = spring_of(asked, i, mass, constants.damping_ratio), 1
        for k in range(len(ticks)):
            while tick < ticks[k]:
                advance(offset, i, period, derivatives(offset, i, push.x[i] / mass, push.y[i] / mass, spring), spring)
                tick += 1
            t, first = tick * period, Point.size * k
            now = Point(ahead[first : first + Point.size])
            for axis in range(2):
                v, a, j = asked.velocity[axis, i], asked.acceleration[axis, i], asked.jerk[axis, i]
                x = asked.position[axis, i] + t * (v + t * (a / 2.0 + t * j / 6.0))
                now.position[axis, i] = x + offset.position[axis, i]
                now.velocity[axis, i] = v + t * (a + t * j / 2.0) + offset.velocity[axis, i]
