"""The hand's force without a force sensor: what the force balance of the pistons leaves once friction is taken off.

    J^T F = R + friction,   friction = a s0 z,   z = clip(z + dy, -Fc/s0, Fc/s0)
R is what pressures, weight and motion leave unexplained. Friction is an elastic-plastic element (Prandtl) on the measured
motion: unlike LuGre's it does not creep under noise. A resting piston reveals the hand by its bristles alone, which give way by
20 um for 1 N. A sliding one reveals it up to the error of the friction believed. The fraction a < 1 keeps the loop from feeding
itself where less friction is there than believed. What is left at the start, before a hand comes, is taken for an error of the
mass and of the pressure cells.
"""

import math

from baselines.estimation import dry_friction
from baselines.estimation.hand import force_bias
from birthsim_env.loop.signals import Joints, PerPiston
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.linkage import geometry

FRICTION_FRACTION = 0.9
"""a; assumed."""

QUICKNESS = 40.0
"""1/s; assumed: of the low-pass on the force."""

MOST_BIAS = 60.0
"""N; assumed: 2 kg of mass and 25 N of friction are below it."""


class Hand(Rows):
    """What the observer remembers, and what it found."""

    bristle = rows("z1 z2", "m", "deflection of a piston's bristles")
    before = rows("y1 y2", "m", "position of a piston a period ago")
    filtered = rows("filtered_x filtered_y", "N", "force, low-passed")
    bias = rows("bias_x bias_y", "N", "bias of the force")
    force = rows("x y", "N", "force of the hand")


@helper
def observe(
    hand: Hand, time: Array, joints: Joints, pressures: Array, unexplained: Array, p: Rig, period: float, fresh: Array
) -> None:
    """Carries ``hand`` on by one period; ``unexplained`` (2, N), N, is R, ``pressures`` (4, N), Pa, those of the chambers."""
    share, left = period / (1.0 / QUICKNESS + period), PerPiston(unexplained)
    for i in range(time.shape[0]):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints.position[0, i],
            joints.position[1, i],
            p.k1,
            p.k2,
            p.d_squares,
            p.d_product,
            p.sin_gamma3,
            p.cos_gamma3,
        )
        new = fresh[i] > 0.0
        for cylinder in range(2):
            level = dry_friction.level_at(cylinder, pressures, i, p)
            most = dry_friction.level_along(cylinder, 1.0, level, p) / p.s0
            least = -dry_friction.level_along(cylinder, -1.0, level, p) / p.s0
            moved = joints.position[cylinder, i] - hand.before[cylinder, i]
            bristle = 0.0 if new else max(least, min(most, hand.bristle[cylinder, i] + moved))
            hand.bristle[cylinder, i], hand.before[cylinder, i] = bristle, joints.position[cylinder, i]
        f1 = left.first[i] + FRICTION_FRACTION * p.s0 * hand.bristle[0, i]
        f2 = left.second[i] + FRICTION_FRACTION * p.s0 * hand.bristle[1, i]
        across, along = -f1 / kappa, f2
        x, y = across * cosine + along * sine, across * sine - along * cosine
        hand.filtered[0, i] = 0.0 if new else hand.filtered[0, i] + share * (x - hand.filtered[0, i])
        hand.filtered[1, i] = 0.0 if new else hand.filtered[1, i] + share * (y - hand.filtered[1, i])
    force_bias.tare(hand.bias, time, hand.filtered, MOST_BIAS, math.inf, period, hand.force)
