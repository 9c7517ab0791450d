"""The hand's force without a force sensor: what the force balance of the pistons leaves once friction is taken off.

    J^T F = R + friction,   friction = a s0 z,   z = clip(z + dy, -Fc/s0, Fc/s0)
R is what pressures, weight and motion leave unexplained. Friction is an elastic-plastic element (Prandtl) on the measured
motion: unlike LuGre's it does not creep under noise. A resting piston tells the hand by its bristles alone, which give way by
20 um for 1 N. A sliding one tells it up to the error of the friction believed. The fraction a < 1 keeps the loop from feeding
itself where less friction is there than believed. What is left at the start, before a hand comes, is taken for an error of the
mass and of the pressure cells.
"""

from __future__ import annotations

from baselines.estimation import force_bias
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

ROWS = 8
"""Deflections of both pistons' bristles, m, their positions a period ago, m, the force low-passed and its bias, N."""
BRISTLE, BEFORE, FORCE, BIAS = 0, 2, 4, 6

FRICTION_FRACTION = 0.9
"""a; assumed."""

QUICKNESS = 40.0
"""1/s; assumed: of the low-pass on the force."""

MOST_BIAS = 60.0
"""N; assumed: 2 kg of mass and 25 N of friction are below it."""


@helper
def observe(
    memory: Array, time: Array, joints: Array, unexplained: Array, p: Array, period: float, fresh: Array, force: Array
) -> None:  # fmt: skip
    """Carries ``memory`` (ROWS, N) on by one period and writes ``force`` (2, N), N, of the hand.

    ``joints`` (4, N): y1, y2 (m), v1, v2 (m/s); ``unexplained`` (2, N), N, is R.
    """
    share = period / (1.0 / QUICKNESS + period)
    for i in range(time.shape[0]):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        for cylinder in range(2):
            new = fresh[i] > 0.0
            most = (p[at.FC1] if cylinder == 0 else p[at.FC2]) / p[at.BRISTLE_S0]
            moved = joints[cylinder, i] - memory[BEFORE + cylinder, i]
            bristle = 0.0 if new else max(-most, min(most, memory[BRISTLE + cylinder, i] + moved))
            memory[BRISTLE + cylinder, i], memory[BEFORE + cylinder, i] = bristle, joints[cylinder, i]
        f1 = unexplained[0, i] + FRICTION_FRACTION * p[at.BRISTLE_S0] * memory[BRISTLE, i]
        f2 = unexplained[1, i] + FRICTION_FRACTION * p[at.BRISTLE_S0] * memory[BRISTLE + 1, i]
        across, along = -f1 / kappa, f2
        x, y = across * cosine + along * sine, across * sine - along * cosine
        memory[FORCE, i] = 0.0 if fresh[i] > 0.0 else memory[FORCE, i] + share * (x - memory[FORCE, i])
        memory[FORCE + 1, i] = 0.0 if fresh[i] > 0.0 else memory[FORCE + 1, i] + share * (y - memory[FORCE + 1, i])
    force_bias.tare(memory[BIAS:], time, memory[FORCE:BIAS], MOST_BIAS, period, force)
