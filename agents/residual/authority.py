"""The authority of a residual yields where the pistons oscillate, and the stiffness of the law where they swing.

A policy has learned from many rigs; on one that is lighter, or has slower valves, than it takes it for, its correction may
excite what it should calm. As in ``admittance-backstepping``, sustained half waves of the speed error lower the fraction of the
authority that is left, for the rest of the episode; here large ones do more than small ones. One that follows a jump of the
hand is large after none, and costs nothing.

Beyond ``SWING`` the valves saturate, and the law by itself keeps up a swing that it would never have begun, with or without a
residual. It then works with less stiffness, until the swing has died.
"""

from __future__ import annotations

import numpy as np

from baselines.admittance.law import sustained
from baselines.admittance.rows import HalfWave
from baselines.backstepping.cartesian_law import across, along
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

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

CYLINDER = 4
"""Rows of memory per cylinder: the fraction of the authority that is left, 1 to ``LEAST``, and what ``sustained`` remembers."""

SOFTNESS = 2 * CYLINDER
"""Row of the power of ``law.STIFFENING`` that half waves along either cylinder have taken of the stiffness."""

ROWS = SOFTNESS + 1

FRESH = np.zeros(ROWS)
"""What a lane remembers when it starts."""
FRESH[:SOFTNESS:CYLINDER] = 1.0


@helper
def limit_authority(joints: Array, target: Array, p: Array, period: float, level: float, memory: Array) -> None:
    """Carries ``memory`` (ROWS, N) on by one period: y1, y2, v1, v2 are ``joints`` (4, N), ``target`` rows are a reference's.

    Half waves below ``level``, m/s, do not count.
    """
    kept = exact.exp(-period / RECOVERY)
    for i in range(joints.shape[1]):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        error1 = -kappa * joints[2, i] - across(target[2, i], target[3, i], sine, cosine)
        error2 = joints[3, i] - along(target[2, i], target[3, i], sine, cosine)
        memory[SOFTNESS, i] *= kept
        for row, error in ((0, error1), (CYLINDER, error2)):
            peak = sustained(HalfWave(memory[row + 1 : row + CYLINDER]), i, error, period, level, level)
            if peak > SWING:
                memory[SOFTNESS, i] = min(memory[SOFTNESS, i] + SOFTENING, MOST_SOFTENING)
            if peak > 0.0:
                memory[row, i] = max(LEAST, exact.exp2(_LOG2_YIELDING * peak / level) * memory[row, i])
