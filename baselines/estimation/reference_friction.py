"""Friction as it will be on the way that the reference asks for: LuGre, driven by the reference's speed.

It is there before an observer sees it, and since it never looks at the measured speed it cannot excite itself.
"""

from __future__ import annotations

import numpy as np

from baselines.estimation.rows import Joints, Motion
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
def rub(motion: Motion, p: Array, period: float, bristles: Array, drag: Array) -> None:
    """Carries ``bristles`` (2, N) on by one period of ``motion`` and writes what they hold back, ``drag`` (2, N), N.

    N is at most that of a block.
    """
    joints, lanes = Joints(scratch(Joints.size)), bristles.shape[1]
    piston_motion(motion.rows, p, joints.rows, lanes)
    for i in range(lanes):
        bristles[0, i] = bristle(bristles[0, i], joints.speed[0, i], p[at.FC1], p[at.FS1], p, period)
        bristles[1, i] = bristle(bristles[1, i], joints.speed[1, i], p[at.FC2], p[at.FS2], p, period)
        drag[0, i], drag[1, i] = p[at.BRISTLE_S0] * bristles[0, i], p[at.BRISTLE_S0] * bristles[1, i]


@kernel
def forecast(ahead: Array, p: Array, steps: Array, bristles: Array, drag: Array) -> None:
    """Writes the friction ``drag`` (M, 2, N), N, along a motion ``ahead`` (M, 4, N) with x, y, vx, vy at the ends of the M
    ``steps``, s, that begins with ``bristles`` (2, N) as ``rub`` leaves them."""
    z, lanes = bristles.copy(), bristles.shape[1]
    joints = Joints(np.empty((Joints.size, lanes)))
    for k in range(ahead.shape[0]):
        piston_motion(ahead[k], p, joints.rows, lanes)
        for i in range(lanes):
            z[0, i] = bristle(z[0, i], joints.speed[0, i], p[at.FC1], p[at.FS1], p, steps[k])
            z[1, i] = bristle(z[1, i], joints.speed[1, i], p[at.FC2], p[at.FS2], p, steps[k])
            drag[k, 0, i], drag[k, 1, i] = p[at.BRISTLE_S0] * z[0, i], p[at.BRISTLE_S0] * z[1, i]
