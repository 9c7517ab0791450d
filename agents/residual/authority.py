"""The authority of a residual yields where the pistons oscillate, and the stiffness of the law where they swing.

A policy has learned from many rigs; on one that is lighter, or has slower valves, than it takes it for, its correction may
excite what it should calm. As in ``admittance-backstepping``, sustained half waves of the speed error lower the fraction of the
authority that is left, for the rest of the episode; here large ones do more than small ones. One that follows a jump of the
hand is large after none, and costs nothing.

Beyond ``SWING`` the valves saturate, and the law by itself keeps up a swing that it would never have begun, with or without a
residual. It then works with less stiffness, until the swing has died.
"""

from baselines.backstepping.cartesian_law import across, along
from baselines.estimation.hand.half_wave import HalfWave, sustained
from birthsim_env.loop.signals import Joints, Reference
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Rows, part, row, rows
from birthsim_env.physics.linkage import geometry

LEVEL = 0.1
"""m/s of the speed error; smaller half waves do not count. As in ``admittance-backstepping``."""

YIELDING = 0.9
"""What a sustained half wave of the size ``LEVEL`` leaves of the authority; one k times as large, its power k; assumed."""

_LOG2_YIELDING = exact.number("log2", YIELDING)

LEAST = 0.2
"""Fraction of the authority that is always left; assumed: the law alone oscillates less."""

SWING = 0.25
"""m/s of the speed error: a larger sustained half wave also takes stiffness; assumed."""

SOFTENING = 0.5
"""Power of ``law.STIFFENING`` that such a half wave takes: half the stiffness; assumed."""

MOST_SOFTENING = 2.0
"""Most that half waves take together; assumed."""

RECOVERY = 1.0
"""s: time constant with which the stiffness comes back; assumed."""


class Limiter(Rows):
    """What limits the authority."""

    left = rows("1 2", "1", "fraction of the authority on a cylinder that is left, 1 to ``LEAST``")
    wave1 = part(HalfWave, "speed error of cylinder 1")
    wave2 = part(HalfWave, "speed error of cylinder 2")
    softness = row("1", "power of ``law.STIFFENING`` that half waves along either cylinder have taken of the stiffness")


@helper
def _yield(limiter: Limiter, cylinder: int, i: int, peak: float, level: float) -> None:
    """What a sustained half wave of a cylinder takes."""
    if peak > SWING:
        limiter.softness[i] = min(limiter.softness[i] + SOFTENING, MOST_SOFTENING)
    if peak > 0.0:
        left = limiter.left[cylinder, i]
        limiter.left[cylinder, i] = max(LEAST, exact.exp2(_LOG2_YIELDING * peak / level) * left)


@helper
def limit_authority(joints: Joints, target: Reference, p: Rig, period: float, level: float, limiter: Limiter, n: int) -> None:
    """Carries the ``limiter`` of n lanes on by one period. Half waves below ``level``, m/s, do not count."""
    kept, asked = exact.exp(-period / RECOVERY), target.velocity
    for i in range(n):
        y1, y2 = joints.position[0, i], joints.position[1, i]
        vx, vy = asked[0, i], asked[1, i]
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        error1 = -kappa * joints.speed[0, i] - across(vx, vy, sine, cosine)
        error2 = joints.speed[1, i] - along(vx, vy, sine, cosine)
        limiter.softness[i] *= kept
        peak1 = sustained(limiter.wave1, i, error1, period, level, level)
        peak2 = sustained(limiter.wave2, i, error2, period, level, level)
        for cylinder in range(2):
            _yield(limiter, cylinder, i, peak1 if cylinder == 0 else peak2, level)
