"""What the pistons meet that the rig's description does not explain: now, and when they last moved either way.

An observer finds the force that accelerates each piston unexplained; dry friction is a part of it, and jumps where the piston
turns. What was met when the piston last moved out and in tells weight and friction apart, and friction before it jumps.
"""

from __future__ import annotations

from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

BANDWIDTH = 60.0
"""1/s, of the observer where speeds are measured; assumed."""

MOVING = 0.005
"""m/s; assumed: a faster piston slides."""

AVERAGE = 0.2
"""s of sliding over which what was met is averaged; assumed."""

ROWS = 6
"""Unexplained force now, when last moving out, when last moving in: N, of cylinders 1 and 2 each."""


@helper
def remember(joints: Array, disturbance: Array, p: Array, period: float, seen: Array, met: Array) -> None:
    """``seen`` (4, N) is 1 where cylinder 1, 2 has moved out, in; ``met`` (ROWS, N)."""
    fraction = 1.0 - exact.exp(-period / AVERAGE)
    for i in range(joints.shape[1]):
        kappa = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )[5]
        for cylinder in range(2):
            mass = p[at.MASS] * kappa * kappa if cylinder == 0 else p[at.MASS]
            force, speed = mass * disturbance[cylinder, i], joints[2 + cylinder, i]
            met[cylinder, i] = force
            for way in range(2):
                row = 2 * way + cylinder
                moves = speed > MOVING if way == 0 else speed < -MOVING
                if moves:
                    met[2 + row, i] += (fraction if seen[row, i] > 0.0 else 1.0) * (force - met[2 + row, i])
                    seen[row, i] = 1.0
                elif seen[row, i] == 0.0:
                    met[2 + row, i] = force
