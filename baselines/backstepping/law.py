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

import math

from baselines.backstepping.cartesian_stiffness import joint_stiffness1, joint_stiffness2
from baselines.backstepping.gains import damped_gains_miss, equal_gain, equal_gain_misses, inner_gain, outer_gain
from baselines.estimation import dry_friction
from baselines.valve_inverse import (
    CylinderAir,
    air_at,
    force_first_openings,
    one_valve_openings,
    stiffness_of,
    two_valve_openings,
)
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Joints, Reference
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.physics.dynamics import load
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.linkage.inverse_kinematics import piston_reference


class Options(Numbers):
    """Options of the law."""

    pneumatic_gain = number("1/s", "c4")
    sign_width = number("m/s", "width of the smoothed sign")
    weight = number("1", "1 with (14), else 0")
    coulomb_rate = number("1", "1 with the Coulomb friction's part of dF*/dt, else 0")
    damping_ratio = number("1", "damping ratio, or 0 for equal gains")
    one_valve = number("1", "1 with one valve per cylinder, else 0")
    force_first = number("1", "1 where the pneumatic stiffness gives way to the force when a valve saturates, else 0")


class JointReference(Joints):
    """The reference in joint coordinates."""

    acceleration = rows("a1 a2", "m/s2", "acceleration")
    jerk = rows("j1 j2", "m/s3", "jerk")


class Gains(Rows):
    """Of cylinders 1 and 2."""

    c1 = rows("c1_1 c1_2", "1/s", "of the position")
    c2 = rows("c2_1 c2_2", "1/s", "of the speed")
    c3 = rows("c3_1 c3_2", "1/s", "of the force")


class GainInputs(Rows):
    """What gains follow from."""

    stiffness = rows("Kcl1 Kcl2", "N/m", "closed-loop stiffness of the cylinders (18)")
    mass = row("kg", "apparent mass m kappa^2 of cylinder 1")


class DesiredForce(Rows):
    """What the law wants."""

    force_rate = rows("dF1 dF2", "N/s", "dF/dt")
    stiffness_rate = rows("dK1 dK2", "N/(m s)", "dK/dt")
    force = rows("F1 F2", "N", "F*")


class Openings(Rows):
    """Of the valves."""

    opening = rows("P1 N1 P2 N2", "1", "commanded opening, -1 to 1")


class Terms(Rows):
    """What the law works out at one instant."""

    wanted = part(JointReference, "reference")
    needs = part(GainInputs, "of the gains")
    gains = part(Gains, "gains")
    gain_rates = part(Gains, "their rates at constant setpoints, where they are inspected")
    intent = part(DesiredForce, "what the law wants")


LEAST_FACTOR = 1.01
"""Damping relative to equal gains. Below this ratio equal gains are used, since other positive gains may not exist."""


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
def needs_of_gains(joints: Joints, target: Reference, p: Rig, needs: GainInputs, n: int) -> None:
    """Writes what the gains of n lanes follow from."""
    for i in range(n):
        y1, y2 = joints.position[0, i], joints.position[1, i]
        kx, ky = target.stiffness[0, i], target.stiffness[1, i]
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        needs.stiffness[0, i] = joint_stiffness1(kx, ky, kappa, sine, cosine)
        needs.stiffness[1, i] = joint_stiffness2(kx, ky, sine, cosine)
        needs.mass[i] = p.mass * kappa * kappa


@helper
def equal_gains(needs: GainInputs, p: Rig, gains: Gains, n: int) -> int:
    """Writes ``gains`` with c1 = c2 = c3; returns the number of lanes without any."""
    misses = 0
    for i in range(n):
        missed = equal_gain_misses(needs.stiffness[0, i], needs.mass[i], p.fv1)
        missed += equal_gain_misses(needs.stiffness[1, i], p.mass, p.fv2)
        misses += 1 if missed > 0.0 else 0
    for cylinder in range(2):
        viscous = p.fv1 if cylinder == 0 else p.fv2
        for i in range(n):
            mass = needs.mass[i] if cylinder == 0 else p.mass
            gain = equal_gain(needs.stiffness[cylinder, i], mass, viscous)
            gains.c1[cylinder, i], gains.c2[cylinder, i], gains.c3[cylinder, i] = gain, gain, gain
    return misses


@helper
def damped_gains(needs: GainInputs, p: Rig, ratio: float, gains: Gains, n: int) -> int:
    """As ``equal_gains``, with c1 = c3 for the damping B = 2 ``ratio`` sqrt(K m_e)."""
    misses = 0
    for i in range(n):
        missed = 0.0
        for cylinder in range(2):
            mass, viscous = (needs.mass[i], p.fv1) if cylinder == 0 else (p.mass, p.fv2)
            k = needs.stiffness[cylinder, i]
            damping = 2.0 * ratio * math.sqrt(k * mass)
            outer = outer_gain(k, damping, mass, viscous)
            inner = inner_gain(outer, k, mass, viscous)
            missed += damped_gains_miss(outer, inner, k, damping, mass, viscous)
            gains.c1[cylinder, i], gains.c2[cylinder, i], gains.c3[cylinder, i] = outer, inner, outer
        misses += 1 if missed > 0.0 else 0
    return misses


@helper
def raise_damping(needs: GainInputs, p: Rig, factor: Array, gains: Gains, n: int) -> None:
    """Turns equal ``gains`` into those of ``factor`` (n,) times their damping where that is more."""
    for i in range(n):
        if factor[i] > LEAST_FACTOR:
            for cylinder in range(2):
                k, c = needs.stiffness[cylinder, i], gains.c1[cylinder, i]
                mass, viscous = (needs.mass[i], p.fv1) if cylinder == 0 else (p.mass, p.fv2)
                damping = factor[i] * (mass * (3.0 * c * c + 2.0) - k) / (3.0 * c - viscous / mass)
                outer = outer_gain(k, damping, mass, viscous)
                gains.c1[cylinder, i], gains.c3[cylinder, i] = outer, outer
                gains.c2[cylinder, i] = inner_gain(outer, k, mass, viscous)


@helper
def choose_gains(joints: Joints, target: Reference, factor: Array, p: Rig, ratio: float, terms: Terms, n: int) -> int:
    """Writes the gains for the setpoints of ``target``; returns the number of lanes without any.

    ``damped_gains`` where ``ratio`` is more than 0, else equal gains with ``factor`` (n,) times their damping.
    """
    needs_of_gains(joints, target, p, terms.needs, n)
    if ratio > 0.0:
        return damped_gains(terms.needs, p, ratio, terms.gains, n)
    misses = equal_gains(terms.needs, p, terms.gains, n)
    raise_damping(terms.needs, p, factor, terms.gains, n)
    return misses


@helper
def law(seen: Seen, joints: Joints, terms: Terms, p: Rig, options: Options, n: int) -> None:
    """Writes what the law wants of n lanes, with the reference and the gains of ``terms``."""
    c4, width = options.pneumatic_gain, options.sign_width
    compensate, sliding = options.weight, options.coulomb_rate
    wanted, gains, intent = terms.wanted, terms.gains, terms.intent
    target, believed = seen.asked, seen.feedforward
    for i in range(n):
        y1, y2 = joints.position[0, i], joints.position[1, i]
        v1, v2 = joints.speed[0, i], joints.speed[1, i]
        pp1, pn1 = seen.pressure[0, i], seen.pressure[1, i]
        pp2, pn2 = seen.pressure[2, i], seen.pressure[3, i]
        yd1, yd2 = wanted.position[0, i], wanted.position[1, i]
        vd1, vd2 = wanted.speed[0, i], wanted.speed[1, i]
        ad1, ad2 = wanted.acceleration[0, i], wanted.acceleration[1, i]
        m, gravity, atmosphere = p.mass, p.gravity, p.atmosphere
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        pole = 2.0 * r4 * w / s2
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + pole * v1

        fc1 = dry_friction.level_moving(0, v1, seen.pressure, i, p)
        fc2 = dry_friction.level_moving(1, v2, seen.pressure, i, p)
        drag1 = fc1 * smooth_sign(v1, width) + p.fv1 * v1
        drag2 = fc2 * smooth_sign(v2, width) + p.fv2 * v2
        load1 = mechanics.piston_force(pp1, pn1, p.area_p1, p.area_n1, atmosphere) - drag1 + believed.force[0, i]
        load2 = mechanics.piston_force(pp2, pn2, p.area_p2, p.area_n2, atmosphere) - drag2 + believed.force[1, i]
        a1 = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p.inverse_mass, gravity)
        neglected = gravity * cosine + r2 * turn * turn
        a2 = load2 / m + compensate * neglected
        turn_rate = turn * (v1 / r4 + pole * v1) - 2.0 * r4 * a1 / root

        mass1 = m * kappa * kappa
        accel1 = outer_acceleration(y1, v1, yd1, vd1, ad1, gains.c1[0, i], gains.c2[0, i])
        jerk1 = outer_jerk(v1, a1, vd1, ad1, wanted.jerk[0, i], gains.c1[0, i], gains.c2[0, i])
        transport = v1 * (growth + v2 / r2)
        stretch = a2 / r2 - v2 * v2 / (r2 * r2)
        pole_rate = v1 * ((2.0 * w + 4.0 * r4 * r4) / s2 + 2.0 * pole * pole)
        growth_rate = stretch + a1 / r4 - v1 * v1 / (r4 * r4) + pole * a1 + pole_rate * v1
        transport_rate = a1 * (growth + v2 / r2) + v1 * (growth_rate + stretch)
        net1 = pp1 * p.area_p1 - pn1 * p.area_n1
        star1 = mass1 * (accel1 + transport) + (net1 - load1) - m * kappa * gravity * sine
        star1_rate = (
            mass1 * (2.0 * growth * (accel1 + transport) + jerk1 + transport_rate)
            + (sliding * fc1 * smooth_sign_slope(v1, width) + p.fv1) * a1
            - m * gravity * kappa * (growth * sine + cosine * turn)
        )
        star1_rate -= believed.rate[0, i]  # as F* takes off what is believed
        z2 = v1 - vd1 + gains.c1[0, i] * (y1 - yd1)
        intent.force_rate[0, i] = star1_rate - mass1 * z2 - gains.c3[0, i] * (net1 - star1)

        accel2 = outer_acceleration(y2, v2, yd2, vd2, ad2, gains.c1[1, i], gains.c2[1, i])
        jerk2 = outer_jerk(v2, a2, vd2, ad2, wanted.jerk[1, i], gains.c1[1, i], gains.c2[1, i])
        neglected_rate = -gravity * sine * turn + v2 * turn * turn + 2.0 * r2 * turn * turn_rate
        net2 = pp2 * p.area_p2 - pn2 * p.area_n2
        star2 = m * (accel2 - compensate * neglected) + (net2 - load2)
        star2_rate = m * (jerk2 - compensate * neglected_rate) + (sliding * fc2 * smooth_sign_slope(v2, width) + p.fv2) * a2
        star2_rate -= believed.rate[1, i]
        z2 = v2 - vd2 + gains.c1[1, i] * (y2 - yd2)
        intent.force_rate[1, i] = star2_rate - m * z2 - gains.c3[1, i] * (net2 - star2)

        kp1 = stiffness_of(air_at(0, pp1, pn1, y1, v1, p), p)
        kp2 = stiffness_of(air_at(1, pp2, pn2, y2, v2, p), p)
        intent.stiffness_rate[0, i] = target.pneumatic_stiffness_rate[0, i] - c4 * (kp1 - target.pneumatic_stiffness[0, i])
        intent.stiffness_rate[1, i] = target.pneumatic_stiffness_rate[1, i] - c4 * (kp2 - target.pneumatic_stiffness[1, i])
        intent.force[0, i], intent.force[1, i] = star1, star2


@helper
def openings_of(rate: float, stiffness_rate: float, air: CylinderAir, p: Rig, options: Options) -> tuple[float, float]:
    """Openings of a cylinder's valves for dF/dt and dK/dt."""
    if options.one_valve > 0.0:
        return one_valve_openings(rate, air, p)
    if options.force_first > 0.0:
        return force_first_openings(rate, stiffness_rate, air, p)
    return two_valve_openings(rate, stiffness_rate, air, p)


@helper
def openings_for(
    seen: Seen, joints: Joints, intent: DesiredForce, p: Rig, options: Options, openings: Openings, n: int
) -> None:
    """Writes the ``openings`` of n lanes for what the law wants."""
    opening, pressure, rate, stiffness_rate = openings.opening, seen.pressure, intent.force_rate, intent.stiffness_rate
    for i in range(n):
        first = air_at(0, pressure[0, i], pressure[1, i], joints.position[0, i], joints.speed[0, i], p)
        second = air_at(1, pressure[2, i], pressure[3, i], joints.position[1, i], joints.speed[1, i], p)
        opening[0, i], opening[1, i] = openings_of(rate[0, i], stiffness_rate[0, i], first, p, options)
        opening[2, i], opening[3, i] = openings_of(rate[1, i], stiffness_rate[1, i], second, p, options)


@helper
def command(seen: Seen, joints: Joints, p: Rig, options: Options, n: int) -> int:
    """Writes the openings of n lanes, at most BLOCK, with a rig's parameters (PARAMETERS,); returns how many have no gains."""
    # Openings of their own, apart from what they follow from: only then LLVM vectorises their loops.
    terms, openings = Terms(scratch(Terms.size)), Openings(scratch(Openings.size))
    piston_reference(seen.asked.rows, p, terms.wanted.rows, n)
    misses = choose_gains(joints, seen.asked, seen.damping_factor, p, options.damping_ratio, terms, n)
    law(seen, joints, terms, p, options, n)
    openings_for(seen, joints, terms.intent, p, options, openings, n)
    load(openings.opening, 0, n, seen.opening)
    return misses
