"""The hand's force with an acceleration sensor: what moves the head, less what pressures, weight and friction explain.

    F = m (a - g) - J^-T (F_chambers - Fv v - s0 z),   z' = v - s0 |v| z/G(v)
Friction is LuGre on the speed that ``inertial`` finds, which no model of rig or hand enters. While a piston slides, z is known
to the error of the rig's friction. While it rests, noise of the tracker moves z: 20 um of position are 1 N. So the force is
held at rest (``held_force``).

What is left at the start, before a hand comes, is taken for an error of the mass and of the pressure cells.
"""

import math

from baselines.estimation.hand import force_bias, held_force
from baselines.estimation.hand.force_observer import MOST_BIAS, Hand
from baselines.estimation.hand.held_force import Hold
from baselines.estimation.inertial import Moving
from birthsim_env.loop.signals import Joints, PerChamber
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import friction, geometry, mechanics
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig

QUICKNESS = 500.0
"""1/s, of the low-pass on the force; found by trial. A slower one makes the head swing against a clamp."""


@helper
def _drag(hand: Hand, joints: Joints, cylinder: int, i: int, p: Rig, period: float) -> float:
    """Carries the bristle of a piston on by one period; returns its friction, N."""
    coulomb, static = (p.fc1, p.fs1) if cylinder == 0 else (p.fc2, p.fs2)
    speed, z = joints.speed[cylinder, i], hand.bristle[cylinder, i]
    level = friction.stribeck_level(speed, coulomb, static, p.stribeck)
    z += period * friction.bristle_rate(speed, z, level, p.s0)
    hand.bristle[cylinder, i] = max(-static / p.s0, min(static / p.s0, z))
    viscous = p.fv1 if cylinder == 0 else p.fv2
    drag: float = p.s0 * hand.bristle[cylinder, i] + viscous * speed
    return drag


@helper
def observe(
    hand: Hand, hold: Hold, time: Array, moving: Moving, joints: Joints, pressures: Array, p: Rig, period: float, fresh: Array
) -> None:  # fmt: skip
    """Carries ``hand`` on by one period; ``moving`` is the end effector, ``pressures`` (4, N), Pa, the chambers'."""
    share, air, bare = period / (1.0 / QUICKNESS + period), PerChamber(pressures), scratch(2)[:, : time.shape[0]]
    for i in range(time.shape[0]):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product,
            p.sin_gamma3, p.cos_gamma3,
        )  # fmt: skip
        if fresh[i] > 0.0:
            hand.bristle[0, i], hand.bristle[1, i] = 0.0, 0.0
        load1 = mechanics.piston_force(air.p1[i], air.n1[i], p.area_p1, p.area_n1, p.atmosphere)
        load2 = mechanics.piston_force(air.p2[i], air.n2[i], p.area_p2, p.area_n2, p.atmosphere)
        load1, load2 = load1 - _drag(hand, joints, 0, i, p, period), load2 - _drag(hand, joints, 1, i, p, period)
        ax, ay = moving.acceleration[0, i], moving.acceleration[1, i] + p.gravity
        across, along = load1 / kappa, -load2
        x, y = p.mass * ax + across * cosine + along * sine, p.mass * ay + across * sine - along * cosine
        hand.filtered[0, i] = 0.0 if fresh[i] > 0.0 else hand.filtered[0, i] + share * (x - hand.filtered[0, i])
        hand.filtered[1, i] = 0.0 if fresh[i] > 0.0 else hand.filtered[1, i] + share * (y - hand.filtered[1, i])
    force_bias.tare(hand.bias, time, hand.filtered, MOST_BIAS, math.inf, period, bare)
    held_force.hold(hold, bare, period, fresh, hand.force)
