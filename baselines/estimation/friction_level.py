"""Friction of each piston, identified while it slides: least mean squares on what the force balance leaves.

What the known forces leave, R, is friction that opposes sliding and a part that knows no direction: an error of the mass, of
the pressures or of the force sensor. With u in [-1, 1], friction along the reference over that believed,
    R = -level Fc u - offset,   e = R + level Fc u + offset,   level' = -a e u / Fc,   offset' = -a e
while the piston slides as u says. Only sliding in both directions tells the two apart. R is the feedforward that was given plus
what the observer found besides, so that it does not depend on what has been learned.
"""

from __future__ import annotations

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

ROWS = 6
"""Levels of both pistons, offsets, N, and low-passed u."""
LEVEL, OFFSET, SLIDES = 0, 2, 4

LAG = 0.02
"""s; assumed: u is low-passed as the observer delays R."""

SLIDING = 0.8
"""assumed: low-passed |u| beyond which a piston has been sliding one way for long enough, some 30 ms."""

SPEED = 3e-3
"""m/s; assumed: a slower piston may be stuck, and then its friction is anything."""

LEAST, MOST = 0.2, 3.0
"""Bounds of the level; assumed."""


@helper
def learn(
    memory: Array, drag: Array, coulomb1: float, coulomb2: float, joints: Array, unexplained: Array, period: float, rate: float,
    fresh: Array,
) -> None:  # fmt: skip
    """Carries ``memory`` (ROWS, N) on by one period.

    ``drag`` (2, N), N, is the believed friction along the reference; ``unexplained`` (2, N), N, is R; ``rate``, a in 1/s.
    """
    for i in range(drag.shape[1]):
        for cylinder in range(2):
            coulomb = coulomb1 if cylinder == 0 else coulomb2
            if fresh[i] > 0.0:
                memory[LEVEL + cylinder, i], memory[OFFSET + cylinder, i], memory[SLIDES + cylinder, i] = 1.0, 0.0, 0.0
            if coulomb <= 0.0:
                continue
            u = max(-1.0, min(1.0, drag[cylinder, i] / coulomb))
            memory[SLIDES + cylinder, i] += period / (LAG + period) * (u - memory[SLIDES + cylinder, i])
            slides = memory[SLIDES + cylinder, i]
            if abs(slides) > SLIDING and slides * joints[2 + cylinder, i] > SPEED * abs(slides):
                level, offset = memory[LEVEL + cylinder, i], memory[OFFSET + cylinder, i]
                error = unexplained[cylinder, i] + level * coulomb * slides + offset
                memory[LEVEL + cylinder, i] = max(LEAST, min(MOST, level - period * rate * error * slides / coulomb))
                memory[OFFSET + cylinder, i] = offset - period * rate * error
