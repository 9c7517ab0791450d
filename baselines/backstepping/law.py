"""The paper's backstepping law as kernels over lanes (the paper's section IV and Fig. 3).

Per cylinder, with z1 = y - yd, z2 = v - (vd - c1 z1), z3 = F - F*, dv/dt = f + g F and 1/g = m_e:
    F*    = (ad - c1 (v - vd) - f - z1 - c2 z2) / g
    dF/dt = dF*/dt - z2/g - c3 z3         -> qA from (10)
    dK/dt = dKd/dt - c4 (K - Kd)          -> qT from (10)
dF*/dt is taken along the model, whose acceleration is f + g F without the user's force. Written out with
A = ad - c1 (v - vd) - z1 - c2 z2, kappa' = kappa (v2/r2 + v1/r4 + p v1), p = 2 r4 w / S^2:
    F1* = m kappa^2 (A1 + transport) + Fext1 + Ff1 - m kappa g sin(theta1),  transport = v1 (kappa'/kappa + v2/r2)
    F2* = m A2 + Fext2 + Ff2 - [m (g cos(theta1) + r2 theta1'^2), the part (14) that weight compensation puts back]
"""

from __future__ import annotations

import math

import numpy as np

from baselines.backstepping.cartesian_stiffness import joint_stiffness1, joint_stiffness2
from baselines.backstepping.gains import damped_gains_miss, equal_gain, equal_gain_misses, inner_gain, outer_gain
from baselines.valve_inverse import force_first_openings, one_valve_openings, two_valve_openings
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import control_model, geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import BLOCK, helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import load, store
from birthsim_env.physics.inverse_kinematics import piston_reference

OPTIONS = 7
PNEUMATIC_GAIN, SIGN_WIDTH, WEIGHT, COULOMB_RATE, DAMPING_RATIO, ONE_VALVE, FORCE_FIRST = range(OPTIONS)
"""Entries of a law's options: c4 (1/s); width of the smoothed sign (m/s); 1 with (14), else 0; 1 with the Coulomb friction's
part of dF*/dt, else 0; damping ratio, or 0 for equal gains; 1 with one valve per cylinder, else 0; 1 where the pneumatic
stiffness gives way to the force when a valve saturates, else 0."""

GAINS, INTENTS = 6, 6
"""Rows of gains: c1, c2, c3 of cylinder 1, then of cylinder 2. Rows of what the law wants: dF/dt of cylinders 1 and 2 (N/s),
dK/dt of both (N/(m s)), F* of both (N)."""

TOLD = 5
"""Rows of feedforward: known forces along cylinders 1 and 2 (N), their rates (N/s), and the damping relative to equal gains."""

LEAST_FACTOR = 1.01
"""Damping relative to equal gains. Below this ratio equal gains are used, since other positive gains may not exist."""

CLEARANCE = 0.002
"""m; assumed: no chamber counts as shorter. Near an end stop a sensor may place the piston outside its stroke, where (9) has no
meaning."""

STEP = 1e-4
"""s; half the distance of the central difference that gives the rates of the gains, exact to 1e-7 of them."""


@helper
def smooth_sign(speed: float, width: float) -> float:
    """sign(v) of (4) as v / sqrt(v^2 + width^2)."""
    return speed / math.sqrt(speed * speed + width * width)


@helper
def smooth_sign_slope(speed: float, width: float) -> float:
    """Derivative of ``smooth_sign``, s/m."""
    square = speed * speed + width * width
    return width * width / (square * math.sqrt(square))


@helper
def outer_acceleration(y: float, v: float, yd: float, vd: float, ad: float, c1: float, c2: float) -> float:
    """A = ad - c1 (v - vd) - z1 - c2 z2: the acceleration that F* asks for, m/s2."""
    z1 = y - yd
    return ad - c1 * (v - vd) - z1 - c2 * (v - vd + c1 * z1)


@helper
def outer_jerk(v: float, a: float, vd: float, ad: float, jd: float, c1: float, c2: float) -> float:
    """dA/dt along the model's acceleration ``a``, m/s3."""
    return jd - c1 * (a - ad) - (v - vd) - c2 * (a - ad + c1 * (v - vd))


@helper
def force_rate_command(
    rate: float, force: float, wanted: float, y: float, v: float, yd: float, vd: float, c1: float, c3: float,
    apparent_mass: float,
) -> float:  # fmt: skip
    """dF/dt = dF*/dt - z2/g - c3 z3, N/s."""
    z2 = v - vd + c1 * (y - yd)
    return rate - apparent_mass * z2 - c3 * (force - wanted)


@helper
def asked_of_cylinders(joints: Array, target: Array, p: Array, asked: Array, n: int) -> None:
    """Writes ``asked`` (3, n): Kcl1 and Kcl2 of (18), N/m, and the apparent mass m kappa^2 of cylinder 1, kg."""
    for i in range(n):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        asked[0, i] = joint_stiffness1(target[8, i], target[9, i], kappa, sine, cosine)
        asked[1, i] = joint_stiffness2(target[8, i], target[9, i], sine, cosine)
        asked[2, i] = p[at.MASS] * kappa * kappa


@helper
def equal_gains(asked: Array, p: Array, gains: Array, n: int) -> int:
    """Writes ``gains`` (6, n) with c1 = c2 = c3 for what is ``asked`` (3, n); returns the number of lanes without any."""
    m, misses = p[at.MASS], 0
    for i in range(n):
        k1, k2, mass1 = asked[0, i], asked[1, i], asked[2, i]
        missed = equal_gain_misses(k1, mass1, p[at.FV1]) + equal_gain_misses(k2, m, p[at.FV2])
        misses += 1 if missed > 0.0 else 0
    for i in range(n):
        first, second = equal_gain(asked[0, i], asked[2, i], p[at.FV1]), equal_gain(asked[1, i], m, p[at.FV2])
        gains[0, i], gains[1, i], gains[2, i] = first, first, first
        gains[3, i], gains[4, i], gains[5, i] = second, second, second
    return misses


@helper
def damped_gains(asked: Array, p: Array, ratio: float, gains: Array, n: int) -> int:
    """As ``equal_gains``, with c1 = c3 for the damping B = 2 ``ratio`` sqrt(K m_e)."""
    m, misses = p[at.MASS], 0
    for i in range(n):
        k1, k2, mass1 = asked[0, i], asked[1, i], asked[2, i]
        b1, b2 = 2.0 * ratio * math.sqrt(k1 * mass1), 2.0 * ratio * math.sqrt(k2 * m)
        outer1, outer2 = outer_gain(k1, b1, mass1, p[at.FV1]), outer_gain(k2, b2, m, p[at.FV2])
        inner1, inner2 = inner_gain(outer1, k1, mass1, p[at.FV1]), inner_gain(outer2, k2, m, p[at.FV2])
        missed = damped_gains_miss(outer1, inner1, k1, b1, mass1, p[at.FV1])
        missed += damped_gains_miss(outer2, inner2, k2, b2, m, p[at.FV2])
        misses += 1 if missed > 0.0 else 0
        gains[0, i], gains[1, i], gains[2, i] = outer1, inner1, outer1
        gains[3, i], gains[4, i], gains[5, i] = outer2, inner2, outer2
    return misses


@helper
def raise_damping(asked: Array, p: Array, factor: Array, gains: Array, n: int) -> None:
    """Turns equal ``gains`` (6, n) into those of ``factor`` (n,) times their damping where that is more."""
    for i in range(n):
        if factor[i] > LEAST_FACTOR:
            for cylinder in range(2):
                row, k = 3 * cylinder, asked[cylinder, i]
                mass, viscous = (asked[2, i], p[at.FV1]) if cylinder == 0 else (p[at.MASS], p[at.FV2])
                c = gains[row, i]
                damping = factor[i] * (mass * (3.0 * c * c + 2.0) - k) / (3.0 * c - viscous / mass)
                outer = outer_gain(k, damping, mass, viscous)
                gains[row, i], gains[row + 1, i], gains[row + 2, i] = outer, inner_gain(outer, k, mass, viscous), outer


@helper
def choose_gains(
    joints: Array, target: Array, p: Array, ratio: float, factor: Array, asked: Array, gains: Array, n: int
) -> int:  # fmt: skip
    """Writes ``gains`` (6, n) for the setpoints of ``target`` (15, n); returns the number of lanes without any.

    ``damped_gains`` where ``ratio`` is more than 0, else equal gains with ``factor`` (n,) times their damping. ``asked`` (3, n)
    is scratch.
    """
    asked_of_cylinders(joints, target, p, asked, n)
    if ratio > 0.0:
        return damped_gains(asked, p, ratio, gains, n)
    misses = equal_gains(asked, p, gains, n)
    raise_damping(asked, p, factor, gains, n)
    return misses


@helper
def chamber_lengths(y: float, half: float) -> tuple[float, float]:
    """Lp and Ln (m) of a cylinder with strokes of +-``half`` at ``y``, for (9) and (10)."""
    return max(half + y, CLEARANCE), max(half - y, CLEARANCE)


@helper
def law(
    joints: Array, pressures: Array, wanted: Array, target: Array, believed: Array, gains: Array, p: Array, options: Array,
    intent: Array, n: int,
) -> None:  # fmt: skip
    """Writes what the law wants, ``intent`` (6, n), for n lanes.

    ``joints`` (4, n): y1, y2, v1, v2. ``wanted`` (8, n): the reference in joint coordinates. ``target`` (15, n): the
    reference. ``believed`` (TOLD, n): what the law is told. ``gains`` (6, n).
    """
    c4, width, compensate, sliding = options[PNEUMATIC_GAIN], options[SIGN_WIDTH], options[WEIGHT], options[COULOMB_RATE]
    for i in range(n):
        y1, y2, v1, v2 = joints[0, i], joints[1, i], joints[2, i], joints[3, i]
        pp1, pn1, pp2, pn2 = pressures[0, i], pressures[1, i], pressures[2, i], pressures[3, i]
        m, gravity, atmosphere = p[at.MASS], p[at.GRAVITY], p[at.ATMOSPHERE]
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            y1, y2, p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        pole = 2.0 * r4 * w / s2
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + pole * v1

        drag1 = p[at.FC1] * smooth_sign(v1, width) + p[at.FV1] * v1
        drag2 = p[at.FC2] * smooth_sign(v2, width) + p[at.FV2] * v2
        load1 = mechanics.piston_force(pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], atmosphere) - drag1 + believed[0, i]
        load2 = mechanics.piston_force(pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], atmosphere) - drag2 + believed[1, i]
        a1 = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS], gravity)
        neglected = gravity * cosine + r2 * turn * turn
        a2 = load2 / m + compensate * neglected
        turn_rate = turn * (v1 / r4 + pole * v1) - 2.0 * r4 * a1 / root

        mass1 = m * kappa * kappa
        accel1 = outer_acceleration(y1, v1, wanted[0, i], wanted[2, i], wanted[4, i], gains[0, i], gains[1, i])
        jerk1 = outer_jerk(v1, a1, wanted[2, i], wanted[4, i], wanted[6, i], gains[0, i], gains[1, i])
        transport = v1 * (growth + v2 / r2)
        stretch = a2 / r2 - v2 * v2 / (r2 * r2)
        pole_rate = v1 * ((2.0 * w + 4.0 * r4 * r4) / s2 + 2.0 * pole * pole)
        growth_rate = stretch + a1 / r4 - v1 * v1 / (r4 * r4) + pole * a1 + pole_rate * v1
        transport_rate = a1 * (growth + v2 / r2) + v1 * (growth_rate + stretch)
        net1 = pp1 * p[at.AREA_P1] - pn1 * p[at.AREA_N1]
        star1 = mass1 * (accel1 + transport) + (net1 - load1) - m * kappa * gravity * sine
        star1_rate = (
            mass1 * (2.0 * growth * (accel1 + transport) + jerk1 + transport_rate)
            + (sliding * p[at.FC1] * smooth_sign_slope(v1, width) + p[at.FV1]) * a1
            - m * gravity * kappa * (growth * sine + cosine * turn)
        )
        # F* takes off what is believed, and dF*/dt its rate.
        star1_rate -= believed[2, i]
        intent[0, i] = force_rate_command(
            star1_rate, net1, star1, y1, v1, wanted[0, i], wanted[2, i], gains[0, i], gains[2, i], mass1
        )

        accel2 = outer_acceleration(y2, v2, wanted[1, i], wanted[3, i], wanted[5, i], gains[3, i], gains[4, i])
        jerk2 = outer_jerk(v2, a2, wanted[3, i], wanted[5, i], wanted[7, i], gains[3, i], gains[4, i])
        neglected_rate = -gravity * sine * turn + v2 * turn * turn + 2.0 * r2 * turn * turn_rate
        net2 = pp2 * p[at.AREA_P2] - pn2 * p[at.AREA_N2]
        star2 = m * (accel2 - compensate * neglected) + (net2 - load2)
        star2_rate = (
            m * (jerk2 - compensate * neglected_rate) + (sliding * p[at.FC2] * smooth_sign_slope(v2, width) + p[at.FV2]) * a2
        )
        star2_rate -= believed[3, i]
        intent[1, i] = force_rate_command(
            star2_rate, net2, star2, y2, v2, wanted[1, i], wanted[3, i], gains[3, i], gains[5, i], m
        )

        lp1, ln1 = chamber_lengths(y1, p[at.HALF_L1])
        lp2, ln2 = chamber_lengths(y2, p[at.HALF_L2])
        kp1 = control_model.pneumatic_stiffness(pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], lp1, ln1, p[at.INDEX])
        kp2 = control_model.pneumatic_stiffness(pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], lp2, ln2, p[at.INDEX])
        intent[2, i] = target[12, i] - c4 * (kp1 - target[10, i])
        intent[3, i] = target[13, i] - c4 * (kp2 - target[11, i])
        intent[4, i], intent[5, i] = star1, star2


@helper
def openings_for(joints: Array, pressures: Array, intent: Array, p: Array, options: Array, u: Array, n: int) -> None:
    """Writes the openings ``u`` (4, n) for what the law wants, ``intent`` (6, n)."""
    one_valve, force_first = options[ONE_VALVE] > 0.0, options[FORCE_FIRST] > 0.0
    for i in range(n):
        y1, y2, v1, v2 = joints[0, i], joints[1, i], joints[2, i], joints[3, i]
        pp1, pn1, pp2, pn2 = pressures[0, i], pressures[1, i], pressures[2, i], pressures[3, i]
        lp1, ln1 = chamber_lengths(y1, p[at.HALF_L1])
        lp2, ln2 = chamber_lengths(y2, p[at.HALF_L2])
        if one_valve:
            one_valve_openings(u, i, 0, intent[0, i], pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], lp1, ln1, v1, p)
            one_valve_openings(u, i, 2, intent[1, i], pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], lp2, ln2, v2, p)
        elif force_first:
            force_first_openings(u, i, 0, intent[0, i], intent[2, i], pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], lp1, ln1, v1, p)
            force_first_openings(u, i, 2, intent[1, i], intent[3, i], pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], lp2, ln2, v2, p)
        else:
            two_valve_openings(u, i, 0, intent[0, i], intent[2, i], pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], lp1, ln1, v1, p)
            two_valve_openings(u, i, 2, intent[1, i], intent[3, i], pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], lp2, ln2, v2, p)


@helper
def command(
    joints: Array, pressures: Array, reference: Array, believed: Array, p: Array, options: Array, openings: Array
) -> int:  # fmt: skip
    """Writes ``openings`` (4, N) for N lanes and one rig's parameters (PARAMETERS,); returns how many lanes have no gains.

    ``joints`` (4, N): y1, y2, v1, v2; ``pressures`` (4, N); ``reference`` (15, N); ``believed`` (TOLD, N);
    ``options`` (OPTIONS,).
    """
    x, air, r, wanted, told, u = scratch(4), scratch(4), scratch(REFERENCES), scratch(8), scratch(TOLD), scratch(4)
    asked, gains, intent, misses = scratch(3), scratch(GAINS), scratch(INTENTS), 0
    for first in range(0, joints.shape[1], BLOCK):
        n = min(BLOCK, joints.shape[1] - first)
        load(joints, first, n, x)
        load(pressures, first, n, air)
        load(reference, first, n, r)
        load(believed, first, n, told)
        piston_reference(r, p, wanted, n)
        misses += choose_gains(x, r, p, options[DAMPING_RATIO], told[4], asked, gains, n)
        law(x, air, wanted, r, told, gains, p, options, intent, n)
        openings_for(x, air, intent, p, options, u, n)
        store(u, first, n, openings)
    return misses


@kernel
def inspect(
    joints: Array, pressures: Array, reference: Array, believed: Array, p: Array, options: Array, wanted: Array, gains: Array,
    gain_rates: Array, intent: Array,
) -> None:  # fmt: skip
    """What goes on inside ``command``, for analysis: ``wanted`` (8, N), ``gains`` and their rates (6, N), ``intent`` (6, N)."""
    n = joints.shape[1]
    asked, moved, ahead, behind = np.empty((3, n)), joints.copy(), np.empty((GAINS, n)), np.empty((GAINS, n))
    for fraction, there in ((1.0, ahead), (-1.0, behind)):
        moved[0:2] = joints[0:2] + fraction * STEP * joints[2:4]
        choose_gains(moved, reference, p, options[DAMPING_RATIO], believed[4], asked, there, n)
    gain_rates[:] = (ahead - behind) / (2.0 * STEP)
    piston_reference(reference, p, wanted, n)
    choose_gains(joints, reference, p, options[DAMPING_RATIO], believed[4], asked, gains, n)
    law(joints, pressures, wanted, reference, believed, gains, p, options, intent, n)
