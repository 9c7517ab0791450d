"""The paper's backstepping law as a kernel over lanes (design section 5, the paper's sections IV and Fig. 3).

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

from baselines.cartesian_stiffness import joint_stiffness1, joint_stiffness2
from baselines.gains import equal_gain
from baselines.valve_inverse import two_valve_openings
from birthsim_env import control_model, geometry, mechanics
from birthsim_env import lanes as at
from birthsim_env.compilation import BLOCK, helper, kernel
from birthsim_env.dynamics import load, store
from birthsim_env.inverse_kinematics import piston_reference
from birthsim_env.lanes import Array
from birthsim_env.signals import REFERENCES


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
def outer_acceleration(y: float, v: float, yd: float, vd: float, ad: float, c: float) -> float:
    """A = ad - c1 (v - vd) - z1 - c2 z2 with equal gains: the acceleration that F* asks for, m/s2."""
    z1 = y - yd
    return ad - c * (v - vd) - z1 - c * (v - vd + c * z1)


@helper
def outer_jerk(v: float, a: float, vd: float, ad: float, jd: float, c: float) -> float:
    """dA/dt along the model's acceleration ``a``, m/s3."""
    return jd - c * (a - ad) - (v - vd) - c * (a - ad + c * (v - vd))


@helper
def force_rate_command(
    rate: float, force: float, wanted: float, y: float, v: float, yd: float, vd: float, c: float, apparent_mass: float
) -> float:
    """dF/dt = dF*/dt - z2/g - c3 z3, N/s."""
    z2 = v - vd + c * (y - yd)
    return rate - apparent_mass * z2 - c * (force - wanted)


@helper
def law(
    joints: Array, pressures: Array, wanted: Array, target: Array, believed: Array, p: Array, c4: float, width: float,
    compensate: float, u: Array, n: int,
) -> None:  # fmt: skip
    """Openings (4, n) for n lanes.

    ``joints`` (4, n): y1, y2, v1, v2. ``wanted`` (8, n): the reference in joint coordinates. ``target`` (15, n): the
    reference. ``believed`` (2, n): forces along the cylinders that the law is told about, N. ``compensate`` is 1 with (14).
    """
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
        a1 = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, m, gravity)
        neglected = gravity * cosine + r2 * turn * turn
        a2 = load2 / m + compensate * neglected
        turn_rate = turn * (v1 / r4 + pole * v1) - 2.0 * r4 * a1 / root

        mass1 = m * kappa * kappa
        k1 = joint_stiffness1(target[8, i], target[9, i], kappa, sine, cosine)
        k2 = joint_stiffness2(target[8, i], target[9, i], sine, cosine)
        c1 = equal_gain(k1, mass1, p[at.FV1])
        c2 = equal_gain(k2, m, p[at.FV2])

        accel1 = outer_acceleration(y1, v1, wanted[0, i], wanted[2, i], wanted[4, i], c1)
        jerk1 = outer_jerk(v1, a1, wanted[2, i], wanted[4, i], wanted[6, i], c1)
        transport = v1 * (growth + v2 / r2)
        stretch = a2 / r2 - v2 * v2 / (r2 * r2)
        pole_rate = v1 * ((2.0 * w + 4.0 * r4 * r4) / s2 + 2.0 * pole * pole)
        growth_rate = stretch + a1 / r4 - v1 * v1 / (r4 * r4) + pole * a1 + pole_rate * v1
        transport_rate = a1 * (growth + v2 / r2) + v1 * (growth_rate + stretch)
        net1 = pp1 * p[at.AREA_P1] - pn1 * p[at.AREA_N1]
        star1 = mass1 * (accel1 + transport) + (net1 - load1) - m * kappa * gravity * sine
        star1_rate = (
            mass1 * (2.0 * growth * (accel1 + transport) + jerk1 + transport_rate)
            + (p[at.FC1] * smooth_sign_slope(v1, width) + p[at.FV1]) * a1
            - m * gravity * kappa * (growth * sine + cosine * turn)
        )
        rate1 = force_rate_command(star1_rate, net1, star1, y1, v1, wanted[0, i], wanted[2, i], c1, mass1)

        accel2 = outer_acceleration(y2, v2, wanted[1, i], wanted[3, i], wanted[5, i], c2)
        jerk2 = outer_jerk(v2, a2, wanted[3, i], wanted[5, i], wanted[7, i], c2)
        neglected_rate = -gravity * sine * turn + v2 * turn * turn + 2.0 * r2 * turn * turn_rate
        net2 = pp2 * p[at.AREA_P2] - pn2 * p[at.AREA_N2]
        star2 = m * (accel2 - compensate * neglected) + (net2 - load2)
        star2_rate = m * (jerk2 - compensate * neglected_rate) + (p[at.FC2] * smooth_sign_slope(v2, width) + p[at.FV2]) * a2
        rate2 = force_rate_command(star2_rate, net2, star2, y2, v2, wanted[1, i], wanted[3, i], c2, m)

        lp1, ln1, lp2, ln2 = p[at.HALF_L1] + y1, p[at.HALF_L1] - y1, p[at.HALF_L2] + y2, p[at.HALF_L2] - y2
        # Near an end stop a sensor may place the piston outside its stroke, where (9) has no meaning.
        lp1, ln1 = max(lp1, 0.002), max(ln1, 0.002)
        lp2, ln2 = max(lp2, 0.002), max(ln2, 0.002)
        kp1 = control_model.pneumatic_stiffness(pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], lp1, ln1, p[at.INDEX])
        kp2 = control_model.pneumatic_stiffness(pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], lp2, ln2, p[at.INDEX])
        kp1_rate = target[12, i] - c4 * (kp1 - target[10, i])
        kp2_rate = target[13, i] - c4 * (kp2 - target[11, i])
        two_valve_openings(u, i, 0, rate1, kp1_rate, pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], lp1, ln1, v1, p)
        two_valve_openings(u, i, 2, rate2, kp2_rate, pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], lp2, ln2, v2, p)


@kernel
def command(
    joints: Array, pressures: Array, reference: Array, believed: Array, p: Array, c4: float, width: float, compensate: float,
    openings: Array,
) -> None:  # fmt: skip
    """Writes ``openings`` (4, N); arguments as in ``law``, with N lanes and one rig's parameters (PARAMETERS,)."""
    x, air, r = np.empty((4, BLOCK)), np.empty((4, BLOCK)), np.empty((REFERENCES, BLOCK))
    wanted, told, u = np.empty((8, BLOCK)), np.empty((2, BLOCK)), np.empty((4, BLOCK))
    for first in range(0, joints.shape[1], BLOCK):
        n = min(BLOCK, joints.shape[1] - first)
        load(joints, first, n, x)
        load(pressures, first, n, air)
        load(reference, first, n, r)
        load(believed, first, n, told)
        piston_reference(r, p, wanted, n)
        law(x, air, wanted, r, told, p, c4, width, compensate, u, n)
        store(u, first, n, openings)
