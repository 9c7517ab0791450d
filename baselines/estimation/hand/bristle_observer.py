"""The hand's force without a force sensor in a rig whose friction is known: what acts on pistons unseen (``bristle_filter``),
less its noise (``quiet_force``).

What is left at the start, before a hand comes, is taken for an error of the mass and of the pressure cells.
"""

import math

from baselines.estimation.hand import force_bias, quiet_force
from baselines.estimation.hand.bristle_filter import Bristled
from baselines.estimation.hand.bristled_pistons import carry, see
from baselines.estimation.hand.force_observer import MOST_BIAS, Hand
from baselines.estimation.hand.quiet_force import Quiet
from baselines.estimation.rows import AssumedParameters
from birthsim_env.loop.rows import POSITION, Signals
from birthsim_env.loop.signals import Joints, PerChamber, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, part, row
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion

PUSH_NOISE = 3.0
"""N2/s: density of the noise that drives the push; found by trial. At rest it is then averaged over 0.2 s."""


class ContactForce(Rows):
    """What the observer remembers besides ``Hand``."""

    newest = row("s", "time of the newest sample")
    pistons = part(Bristled, "both pistons")
    quiet = part(Quiet, "force as used")


@helper
def observe(
    hand: Hand,
    contact: ContactForce,
    seen: Signals,
    joints: Joints,
    pressures: Array,
    noise: Array,
    assumed: AssumedParameters,
    fresh: Array,
) -> None:
    """Carries ``hand`` and ``contact`` on by one period, at whose end ``joints`` and pressures (4, N), Pa, are known.

    ``noise`` (N,), m, is that of a position sample.
    """
    p, period, b, air = assumed.rig, assumed.period, contact.pistons, PerChamber(pressures)
    sample = Joints(scratch(Joints.size))
    piston_motion(seen.rows[POSITION : POSITION + Point.size], p, sample.rows, fresh.shape[0])
    for i in range(fresh.shape[0]):
        pose = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        _, _, _, _, _, kappa, sine, cosine = pose
        sampled = seen.position_time[i] - contact.newest[i]
        contact.newest[i] = seen.position_time[i]
        carry(b, i, joints, air, pose, noise[i], PUSH_NOISE, p, period, fresh[i] > 0.0)
        if sampled > 0.0:
            see(b, i, sample, joints, kappa, seen.time[i] - seen.position_time[i], noise[i])
        across, along = -b.push[0, i] / kappa, b.push[1, i]
        hand.filtered[0, i], hand.filtered[1, i] = across * cosine + along * sine, across * sine - along * cosine
    bare = scratch(2)[:, : fresh.shape[0]]
    force_bias.tare(hand.bias, seen.time, hand.filtered, MOST_BIAS, math.inf, period, bare)
    quiet_force.quieten(contact.quiet, bare, period, fresh, hand.force)
