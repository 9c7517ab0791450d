"""An extended Kalman filter of one piston: where it is, how far its bristles are bent, and what force acts on it unseen.

    y' = v,   v' = w (L + f - Fv v - s0 z - s1 z') + a0,   z' = v - s0 |v| z/G(v),   f' = noise
with the chambers' force L known from pressures, the answer w to a force and the acceleration a0 without one. Friction is
LuGre's. Position samples correct all four, and so do forces and speeds where an acceleration sensor tells them. A resting
piston reveals f by its bristles, 20 um for 1 N, hence slowly; a sliding one by its acceleration. LuGre on an observed speed
creeps under its noise; here the model alone moves the bristles at rest.
"""

import math
from typing import NamedTuple

from baselines.estimation import dry_friction
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.seals import friction

SPEED_NOISE = 1e-6
"""m2/s3: density of the noise that drives v; found by trial."""

ALERT, EXPECTED, SHARE = 100.0, 2.0, 0.1
"""Samples that are further off than their noise explains make f noisier: by ``ALERT`` times what their squared innovations,
averaged with the weight ``SHARE`` and in units of their variance, exceed ``EXPECTED``. Found by trial."""

FORCE_ALERT, FORCE_EXPECTED, FORCE_SHARE = 300.0, 0.3, 0.1
"""The same where a force is measured, by its innovations; found by trial. At rest their average is 0.02 to 0.14."""

MOST_SURPRISE = 25.0
"""assumed: no squared innovation counts for more, in units of its variance."""

SLIDES = 5e-3
"""m/s; found by trial: a faster piston counts as sliding."""

FIRST_PUSH, FIRST_BRISTLE = 1.0, 2.0
"""N; assumed: standard deviations of f and of s0 z at a start."""

LEAST_FRICTION, LEAST_SPEED = 1e-3, 1e-12
"""N and m/s; assumed: a piston is believed to have no less, so that its bristles bend by a distance and wear down one way."""


class Law(NamedTuple):
    """What is believed of a friction besides its level: LuGre, or what differs from it by where and when bristles yield.

        z' = v - alpha(z) w(v) z/slack,   w(v) = max(|v|, ``creep``)
    alpha is that of the elasto-plastic law with this ``breakaway`` (``friction.sliding_fraction``), or 1. A bristle that yields
    at ``creep``, m/s, at least is a spring behind a damper of G/creep, as which (4) is integrated.
    """

    stiffness: float
    damping: float
    static_ratio: float
    stribeck: float
    breakaway: float
    steepness: float
    creep: float


YIELDS, HOLDS = -1e9, 1e9
"""Breakaways of bristles that yield at any deflection, where alpha is 1, and at none, where it is 0."""


class Bristled(Rows):
    """What is believed of both pistons, and the covariances of what is believed."""

    position = rows("y1 y2", "m", "position")
    speed = rows("v1 v2", "m/s", "speed")
    bristle = rows("z1 z2", "m", "deflection of the bristles")
    push = rows("f1 f2", "N", "force along the piston that is not known")
    yy = rows("yy1 yy2", "m2", "covariance")
    yv = rows("yv1 yv2", "m2/s", "covariance")
    yz = rows("yz1 yz2", "m2", "covariance")
    yf = rows("yf1 yf2", "N m", "covariance")
    vv = rows("vv1 vv2", "m2/s2", "covariance")
    vz = rows("vz1 vz2", "m2/s", "covariance")
    vf = rows("vf1 vf2", "N m/s", "covariance")
    zz = rows("zz1 zz2", "m2", "covariance")
    zf = rows("zf1 zf2", "N m", "covariance")
    ff = rows("ff1 ff2", "N2", "covariance")
    stirred = rows("s1 s2", "1", "squared innovations of the force over their variance, averaged")
    surprise = rows("e1 e2", "1", "squared innovations over their variance, averaged")
    level = rows("Fc1 Fc2", "N", "Coulomb friction at the pressures of the chambers, but for the way of motion")


@helper
def lugre(p: Rig) -> Law:
    """LuGre of the rig as described."""
    return Law(p.s0, p.s1, p.static_ratio, p.stribeck, YIELDS, 1.0, LEAST_SPEED)


@helper
def slack_at(k: int, speed: float, level: float, law: Law, p: Rig) -> float:
    """Deflection, m, at which the bristles of sliding piston ``k`` stay, at the ``level`` of its pressures."""
    coulomb = dry_friction.level_along(k, speed, level, p)
    most = friction.stribeck_level(speed, coulomb, law.static_ratio * coulomb, law.stribeck)
    slack: float = max(most, LEAST_FRICTION) / law.stiffness
    return slack


@helper
def _way(speed: float) -> float:
    """1 or -1, in which a piston goes."""
    return 1.0 if speed > 0.0 else -1.0


@helper
def _yielding(bent: float, law: Law) -> tuple[float, float]:
    """alpha of bristles that are bent by q = ``bent`` = z/slack along the motion, and q times its derivative to q."""
    alpha: float = friction.sliding_fraction(bent, law.breakaway, law.steepness)
    s = max(0.0, min(1.0, (bent - law.breakaway) * law.steepness))
    return alpha, bent * 6.0 * s * (1.0 - s) * law.steepness


@helper
def _wear(speed: float, variance: float, bent: float, law: Law) -> tuple[float, float, float]:
    """Mean of alpha w(v), m/s, where ``speed`` is known with a ``variance``, m2/s2, of a normal distribution to a tenth; its
    derivative to ``speed``; and by how much the derivative of z' to -z/slack is larger, m/s, as alpha grows with z."""
    # The root of the larger one, not the larger root: a slope at a root of 0 is not finite.
    fast = math.sqrt(max(speed * speed + 2.0 / math.pi * max(variance, 0.0), law.creep * law.creep))
    share, grows = _yielding(bent, law)
    return share * fast, share * (speed / fast), grows * fast


@helper
def begin(b: Bristled, k: int, i: int, position: float, speed: float, push: float, noise: float, law: Law, p: Rig) -> None:
    """Starts piston ``k`` of lane ``i`` at a measured ``position`` with a ``speed``, where friction and ``push``, N, balance
    the rest; its ``level`` is there already."""
    b.position[k, i], b.speed[k, i] = position, speed
    b.bristle[k, i] = slack_at(k, speed, b.level[k, i], law, p) * speed / (abs(speed) + SLIDES)
    b.push[k, i] = push + law.stiffness * b.bristle[k, i]
    b.yy[k, i], b.yv[k, i], b.yz[k, i], b.yf[k, i] = noise * noise, 0.0, 0.0, 0.0
    b.vv[k, i], b.vz[k, i], b.vf[k, i] = 0.0, 0.0, 0.0
    bent = min(FIRST_BRISTLE, b.level[k, i]) / law.stiffness
    b.zz[k, i], b.zf[k, i], b.ff[k, i] = bent * bent, 0.0, FIRST_PUSH * FIRST_PUSH
    b.surprise[k, i] = 1.0


@helper
def predict(
    b: Bristled,
    k: int,
    i: int,
    load: float,
    own: float,
    answer: float,
    push_noise: float,
    boost: float,
    unseen: float,
    law: Law,
    p: Rig,
    period: float,
) -> None:
    """Carries piston ``k`` of lane ``i`` on by a period: ``load``, N, of the chambers; ``own``, m/s2, without
    forces; ``answer``, 1/kg, to a force; ``push_noise``, N2/s, that drives f; ``unseen``, the part of the variance of v that is
    motion, which wears bristles down, rather than ignorance of a piston that rests."""
    viscous, level = (p.fv1 if k == 0 else p.fv2), b.level[k, i]
    outwards, inwards = dry_friction.level_along(k, 1.0, level, p), dry_friction.level_along(k, -1.0, level, p)
    most = max(law.static_ratio * outwards, LEAST_FRICTION) / law.stiffness
    least = -max(law.static_ratio * inwards, LEAST_FRICTION) / law.stiffness
    v, z = b.speed[k, i], max(least, min(most, b.bristle[k, i]))
    slack = slack_at(k, v, level, law, p)
    fast, grows, firm = _wear(v, unseen * b.vv[k, i], _way(v) * z / slack, law)
    kept = 1.0 / (1.0 + period * (fast + firm) / slack)
    bends, relaxes = kept * (1.0 - grows * z / slack), kept * (fast + firm) / slack
    rate = own + answer * (load + b.push[k, i] - viscous * v - law.stiffness * z - law.damping * bends * v)
    step = period * answer
    av, az, af = 1.0 - step * (viscous + law.damping * bends), -step * (law.stiffness - law.damping * relaxes), step
    v += period * rate
    slack = slack_at(k, v, level, law, p)
    fast, grows, firm = _wear(v, unseen * b.vv[k, i], _way(v) * z / slack, law)
    kept = 1.0 / (1.0 + period * (fast + firm) / slack)
    z = kept * (z + period * v + period * firm / slack * z)
    bend = period * kept * (1.0 - grows * z / slack)
    b.position[k, i] += period * v
    b.speed[k, i], b.bristle[k, i] = v, z
    spread(b, k, i, (av, az, af), (bend * av, kept + bend * az, bend * af), push_noise, boost, period)


@helper
def spread(
    b: Bristled,
    k: int,
    i: int,
    of_speed: tuple[float, float, float],
    of_bristle: tuple[float, float, float],
    push_noise: float,
    boost: float,
    period: float,
) -> None:
    """Carries the covariances of piston ``k`` of lane ``i`` on by a period, from the derivatives of the next speed and of the
    next deflection to speed, deflection and force; ``push_noise`` and ``boost`` are those of ``predict``."""
    (av, az, af), (bv, bz, bf) = of_speed, of_bristle
    yv, yz, yf = b.yv[k, i], b.yz[k, i], b.yf[k, i]
    vv, vz, vf = b.vv[k, i], b.vz[k, i], b.vf[k, i]
    zz, zf, ff = b.zz[k, i], b.zf[k, i], b.ff[k, i]
    ay, by = av * yv + az * yz + af * yf, bv * yv + bz * yz + bf * yf
    avv, avz, avf = av * vv + az * vz + af * vf, av * vz + az * zz + af * zf, av * vf + az * zf + af * ff
    bvv, bvz, bvf = bv * vv + bz * vz + bf * vf, bv * vz + bz * zz + bf * zf, bv * vf + bz * zf + bf * ff
    vv, vz, zz = (
        av * avv + az * avz + af * avf + period * SPEED_NOISE,
        bv * avv + bz * avz + bf * avf,
        bv * bvv + bz * bvz + bf * bvf,
    )
    alert = ALERT * max(0.0, b.surprise[k, i] - EXPECTED) + FORCE_ALERT * max(0.0, b.stirred[k, i] - FORCE_EXPECTED)
    b.yy[k, i] += period * (2.0 * ay + period * vv)
    b.yv[k, i], b.yz[k, i], b.yf[k, i] = ay + period * vv, by + period * vz, yf + period * avf
    b.vv[k, i], b.vz[k, i], b.vf[k, i] = vv, vz, avf
    b.zz[k, i], b.zf[k, i], b.ff[k, i] = zz, bvf, ff + period * push_noise * (1.0 + alert + boost)


@helper
def _take(b: Bristled, k: int, i: int, y: float, v: float, z: float, f: float, variance: float, innovation: float) -> float:
    """Corrects piston ``k`` of lane ``i`` by a measurement, whose covariances with the state are ``y``, ``v``, ``z`` and ``f``;
    the squared innovation over its variance."""
    weight = 1.0 / variance
    e = weight * innovation
    b.position[k, i] += y * e
    b.speed[k, i] += v * e
    b.bristle[k, i] += z * e
    b.push[k, i] += f * e
    b.yy[k, i] -= y * y * weight
    b.yv[k, i] -= y * v * weight
    b.yz[k, i] -= y * z * weight
    b.yf[k, i] -= y * f * weight
    b.vv[k, i] -= v * v * weight
    b.vz[k, i] -= v * z * weight
    b.vf[k, i] -= v * f * weight
    b.zz[k, i] -= z * z * weight
    b.zf[k, i] -= z * f * weight
    b.ff[k, i] -= f * f * weight
    return min(e * innovation, MOST_SURPRISE)


@helper
def correct(b: Bristled, k: int, i: int, innovation: float, noise: float, age: float = 0.0, answer: float = 0.0) -> float:
    """Takes a position sample of piston ``k`` of lane ``i``: what it is off, m, and its standard deviation, m; the variance of
    the innovation, m2.

    ``innovation`` is that from ``position_ago`` of the same ``age``, s, of a sample that is late. What such a sample is off is
    an error of the position less an ``age`` times that of the speed, and noise that f, by the ``answer`` to it, 1/kg, leaves of
    the way since. As a sample of now it would be answered too much, and the filter would swing. An ``age`` of 0 stands for a
    sample of now, or one carried on with a speed that is not this filter's.
    """
    yy, yv, yz = b.yy[k, i] - age * b.yv[k, i], b.yv[k, i] - age * b.vv[k, i], b.yz[k, i] - age * b.vz[k, i]
    unsure = 0.5 * age * age * answer
    variance: float = yy - age * yv + noise * noise + unsure * unsure * b.ff[k, i]
    found = _take(b, k, i, yy, yv, yz, b.yf[k, i] - age * b.vf[k, i], variance, innovation)
    b.surprise[k, i] += SHARE * (found - b.surprise[k, i])
    return variance


@helper
def position_ago(b: Bristled, k: int, i: int, acceleration: float, age: float) -> float:
    """Where piston ``k`` of lane ``i`` was an ``age``, s, ago, m, if its ``acceleration``, m/s2, has been the same since."""
    there: float = b.position[k, i] - age * (b.speed[k, i] - 0.5 * age * acceleration)
    return there


@helper
def gauge(b: Bristled, k: int, i: int, speed: float, noise: float) -> None:
    """Takes a ``speed`` of piston ``k`` of lane ``i``, m/s, and its standard deviation, m/s."""
    yv, vv, vz, vf = b.yv[k, i], b.vv[k, i], b.vz[k, i], b.vf[k, i]
    _take(b, k, i, yv, vv, vz, vf, vv + noise * noise, speed - b.speed[k, i])


@helper
def drag(b: Bristled, k: int, i: int, grip: float, law: Law, p: Rig) -> float:
    """Friction of piston ``k`` of lane ``i`` as believed, N."""
    v, z = b.speed[k, i], b.bristle[k, i]
    slack = slack_at(k, v, b.level[k, i], law, p)
    rate = grip * v - _yielding(_way(v) * z / slack, law)[0] * max(abs(v), law.creep) * z / slack
    found: float = (p.fv1 if k == 0 else p.fv2) * v + law.damping * rate + law.stiffness * z
    return found


@helper
def weigh(b: Bristled, k: int, i: int, unexplained: float, noise: float, grip: float, law: Law, p: Rig) -> tuple[float, float]:
    """Takes what acceleration, weight and chambers leave unexplained of piston ``k`` of lane ``i``, N, f less friction, and
    its standard deviation, N; the innovation, N, and its variance, N2."""
    v, z = b.speed[k, i], b.bristle[k, i]
    slack = slack_at(k, v, b.level[k, i], law, p)
    share, grows = _yielding(_way(v) * z / slack, law)
    # Derivatives of f less friction, to v and z.
    to_v = -((p.fv1 if k == 0 else p.fv2) + law.damping * (grip - share * _way(v) * z / slack))
    to_z = -(law.stiffness - law.damping * (share + grows) * max(abs(v), law.creep) / slack)
    yh = to_v * b.yv[k, i] + to_z * b.yz[k, i] + b.yf[k, i]
    vh = to_v * b.vv[k, i] + to_z * b.vz[k, i] + b.vf[k, i]
    zh = to_v * b.vz[k, i] + to_z * b.zz[k, i] + b.zf[k, i]
    fh = to_v * b.vf[k, i] + to_z * b.zf[k, i] + b.ff[k, i]
    off, variance = unexplained - (b.push[k, i] - drag(b, k, i, grip, law, p)), to_v * vh + to_z * zh + fh + noise * noise
    found = _take(b, k, i, yh, vh, zh, fh, variance, off)
    b.stirred[k, i] += FORCE_SHARE * (found - b.stirred[k, i])
    return off, variance
