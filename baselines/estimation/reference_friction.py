"""Friction as it will be on the way that the reference asks for: LuGre, driven by the reference's speed.

It is there before an observer sees it, and since it never looks at the measured speed it cannot excite itself.
"""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.stage import scratch
from birthsim_env.physics import friction
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion


@helper
def bristle(z: float, speed: float, coulomb: float, static: float, p: Array, period: float) -> float:
    """Deflection after one period at a piston's ``speed``, m."""
    level = friction.stribeck_level(speed, coulomb, static, p[at.STRIBECK])
    most: float = level / p[at.BRISTLE_S0]
    deflection: float = z + period * friction.bristle_rate(speed, z, level, p[at.BRISTLE_S0])
    return max(-most, min(most, deflection))


@helper
def rub(motion: Array, p: Array, period: float, bristles: Array, drag: Array) -> None:
    """Carries ``bristles`` (2, N) on by one period of ``motion`` (8, N) and writes what they hold back, ``drag`` (2, N), N."""
    one, joints = scratch(4), scratch(4)
    for i in range(motion.shape[1]):
        for row in range(4):
            one[row, 0] = motion[row, i]
        piston_motion(one, p, joints, 1)
        bristles[0, i] = bristle(bristles[0, i], joints[2, 0], p[at.FC1], p[at.FS1], p, period)
        bristles[1, i] = bristle(bristles[1, i], joints[3, 0], p[at.FC2], p[at.FS2], p, period)
        drag[0, i], drag[1, i] = p[at.BRISTLE_S0] * bristles[0, i], p[at.BRISTLE_S0] * bristles[1, i]


@kernel
def forecast(ahead: Array, p: Array, steps: Array, bristles: Array, drag: Array) -> None:
    """Writes the friction ``drag`` (M, 2, N), N, along a motion ``ahead`` (M, 4, N) with x, y, vx, vy at the ends of the M
    ``steps``, s, that begins with ``bristles`` (2, N) as ``rub`` leaves them."""
    one, joints = np.empty((4, 1)), np.empty((4, 1))
    for i in range(ahead.shape[2]):
        z1, z2 = bristles[0, i], bristles[1, i]
        for k in range(ahead.shape[0]):
            for row in range(4):
                one[row, 0] = ahead[k, row, i]
            piston_motion(one, p, joints, 1)
            z1 = bristle(z1, joints[2, 0], p[at.FC1], p[at.FS1], p, steps[k])
            z2 = bristle(z2, joints[3, 0], p[at.FC2], p[at.FS2], p, steps[k])
            drag[k, 0, i], drag[k, 1, i] = p[at.BRISTLE_S0] * z1, p[at.BRISTLE_S0] * z2
