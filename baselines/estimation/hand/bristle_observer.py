"""The hand's force without a force sensor in a rig whose friction is known: what acts on pistons unseen (``bristle_filter``),
less its noise (``quiet_force``).

What is left at the start, before a hand comes, is taken for an error of the mass and of the pressure cells.
"""

import math

from baselines.estimation.hand import bristle_filter, force_bias, quiet_force
from baselines.estimation.hand.bristle_filter import Bristled
from baselines.estimation.hand.bristled_pistons import carry
from baselines.estimation.hand.force_observer import MOST_BIAS, Hand
from baselines.estimation.hand.quiet_force import Quiet
from baselines.estimation.rows import Belief, Pistons
from birthsim_env.loop.rows import POSITION, Signals
from birthsim_env.loop.signals import Joints, PerChamber, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, part, row
from birthsim_env.physics.inverse_kinematics import piston_motion

PUSH_NOISE = 3.0
"""N2/s: density of the noise that drives the push; found by trial. At rest it is then averaged over 0.2 s."""


class Felt(Rows):
    """What the observer remembers besides ``Hand``."""

    newest = row("s", "time of the newest sample")
    pistons = part(Bristled, "both pistons")
    quiet = part(Quiet, "force as used")


@helper
def _since(pistons: Pistons, k: int, i: int, joints: Joints, periods: float) -> float:
    """How far piston ``k`` of lane ``i`` has moved in the last ``periods``, by its observer, m; 0 where speeds are measured."""
    past, slot = pistons.past, int(pistons.slot[i])
    depth = past.shape[0] // 2
    if depth == 0:
        return 0.0
    back = min(int(periods), depth - 2)
    newer, older = past[2 * ((slot - back) % depth) + k, i], past[2 * ((slot - back - 1) % depth) + k, i]
    moved: float = joints.position[k, i] - (newer + min(periods - back, 1.0) * (older - newer))
    return moved


@helper
def observe(
    hand: Hand,
    felt: Felt,
    seen: Signals,
    pistons: Pistons,
    joints: Joints,
    pressures: Array,
    noise: Array,
    about: Belief,
    fresh: Array,
) -> None:
    """Carries ``hand`` and ``felt`` on by one period, at whose end ``pistons`` are observed and pressures (4, N), Pa, known.

    ``noise`` (N,), m, is that of a position sample.
    """
    p, period, b, air = about.rig, about.period, felt.pistons, PerChamber(pressures)
    sample = Joints(scratch(Joints.size))
    piston_motion(seen.rows[POSITION : POSITION + Point.size], p, sample.rows, fresh.shape[0])
    for i in range(fresh.shape[0]):
        pose = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        kappa, sine, cosine = pose[5:]
        sampled = seen.position_time[i] - felt.newest[i]
        felt.newest[i] = seen.position_time[i]
        carry(b, i, joints, air, pose, noise[i], PUSH_NOISE, 0.0, p, period, fresh[i] > 0.0)
        if sampled > 0.0:
            for k in range(2):
                since = _since(pistons, k, i, joints, (seen.time[i] - seen.position_time[i]) / period)
                off = sample.position[k, i] - (b.position[k, i] - since)
                bristle_filter.correct(b, k, i, off, noise[i] / kappa if k == 0 else noise[i])
        across, along = -b.push[0, i] / kappa, b.push[1, i]
        hand.filtered[0, i], hand.filtered[1, i] = across * cosine + along * sine, across * sine - along * cosine
    bare = scratch(2)[:, : fresh.shape[0]]
    force_bias.tare(hand.bias, seen.time, hand.filtered, MOST_BIAS, math.inf, period, bare)
    quiet_force.quieten(felt.quiet, bare, period, fresh, hand.force)
