"""Friction as it will be on the way that the reference asks for: LuGre, driven by the reference's speed.

It is there before an observer sees it, and since it never looks at the measured speed it cannot excite itself.
"""

from baselines.estimation import dry_friction
from birthsim_env.loop.signals import Joints, Motion, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion
from birthsim_env.physics.seals import friction


@helper
def bristle(z: float, speed: float, coulomb: float, p: Rig, period: float) -> float:
    """Deflection after one period at a piston's ``speed``, m, with the level ``coulomb``, N, of its way."""
    level = friction.stribeck_level(speed, coulomb, p.static_ratio * coulomb, p.stribeck)
    most: float = level / p.s0
    deflection: float = z + period * friction.bristle_rate(speed, z, level, p.s0)
    return max(-most, min(most, deflection))


@helper
def _update_bristle(joints: Joints, pressures: Array, p: Rig, period: float, bristles: Array, drag: Array) -> None:
    for cylinder in range(2):
        for i in range(bristles.shape[1]):
            speed = joints.speed[cylinder, i]
            coulomb = dry_friction.level_moving(cylinder, speed, pressures, i, p)
            z = bristle(bristles[cylinder, i], speed, coulomb, p, period)
            bristles[cylinder, i], drag[cylinder, i] = z, p.s0 * z


@helper
def update_bristle(motion: Motion, pressures: Array, p: Rig, period: float, bristles: Array, drag: Array) -> None:
    """Carries ``bristles`` (2, N) on by one period of ``motion`` and writes what they hold back, ``drag`` (2, N), N.

    The chambers are at ``pressures`` (4, N), Pa; N is at most that of a block.
    """
    joints, lanes = Joints(scratch(Joints.size)), bristles.shape[1]
    piston_motion(motion.rows, p, joints.rows, lanes)
    _update_bristle(joints, pressures, p, period, bristles, drag)


@helper
def forecast(ahead: Array, pressures: Array, p: Rig, steps: Array, bristles: Array, drag: Array) -> None:
    """Writes the friction ``drag`` (2 M, N), N, along a motion ``ahead`` (4 M, N) with x, y, vx, vy at the ends of the M
    ``steps``, s, that begins with ``bristles`` (2, N) as ``update_bristle`` leaves them, and carries these on.

    The ``pressures`` (4, N), Pa, are taken to stay.
    """
    joints, (cylinders, lanes) = Joints(scratch(Joints.size)), bristles.shape
    for k in range(len(steps)):
        motion, own = Point.size * k, cylinders * k
        piston_motion(ahead[motion : motion + Point.size], p, joints.rows, lanes)
        _update_bristle(joints, pressures, p, steps[k], bristles, drag[own : own + cylinders])
