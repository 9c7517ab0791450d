"""Backstepping in Cartesian coordinates: a stiffness matrix rendered at any pose, as a stage of the closed loop.

The end effector is a point of mass m, so with J = (u1, u2) of (16) and L_i = F_i - Fext_i - friction_i along the pistons
    m a = P + m g,  P = J^-T L,   and a wanted jerk j asks for   L' = J'^T P + m J^T j.
In components along cylinder 2 (n) and across it (t), u1 = -kappa t, u2 = n, t' = -theta1' n and n' = theta1' t.

The law is that of equal gains with a matrix in the place of the gain, C = (3 K/m - 2)^(1/2), which solves the cubic of
``gains`` without friction, K = m (C^3 + 2 C)/(3 C). Written out, with e = x - xt and the model's acceleration a,
    j = jt - 3 C (a - at + K e/m) - (3 C^2 + 2) (v - vt) + D K e/m^2,   D = J^-T diag(Fv) J^-1.
The last term stands for Fv in the K of ``gains``. At rest under a force Fu, a = -Fu/m, and the law's rate of
friction Fv J^-1 a leaves (3 C - D/m)(K e - Fu) = 0: the hand feels K, whatever the size of e.
"""

from baselines.backstepping.law import smooth_sign
from baselines.estimation import dry_friction
from baselines.estimation.admittance import is_stiffer, square_root
from baselines.estimation.stages import PistonEstimate
from baselines.valve_inverse import air_at, pressure_openings
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, number, part
from birthsim_env.physics.linkage import geometry, mechanics


@helper
def along(x: float, y: float, sine: float, cosine: float) -> float:
    """Component along cylinder 2 of a Cartesian vector."""
    return sine * x - cosine * y


@helper
def across(x: float, y: float, sine: float, cosine: float) -> float:
    """Component across cylinder 2 of a Cartesian vector; extending cylinder 1 makes it negative."""
    return cosine * x + sine * y


@helper
def cartesian(t: float, n: float, sine: float, cosine: float) -> tuple[float, float]:
    """x and y of a vector with components ``t`` across and ``n`` along cylinder 2."""
    return cosine * t + sine * n, sine * t - cosine * n


@helper
def load_rates(
    load1: float, load2: float, growth: float, turn: float, kappa: float, rate_t: float, rate_n: float
) -> tuple[float, float]:
    """L' of both pistons, N/s, for mass times jerk, N/s, across and along cylinder 2; growth: kappa'/kappa, turn: theta1'."""
    force_t, force_n = -load1 / kappa, load2
    rate1 = kappa * (turn * force_n - growth * force_t - rate_t)
    rate2 = turn * force_t + rate_n
    return rate1, rate2


class Constants(Numbers):
    """Of the stage."""

    pneumatic_gain = number("1/s", "c4")
    sign_width = number("m/s", "width of the smoothed sign")
    least_stiffness = number("N/m", "least stiffness setpoint")
    rig = part(Rig, "the rig as described")


@helper
def law(seen: Seen, joints: Joints, constants: Constants, n: int) -> None:
    """Writes the openings of n lanes."""
    p, c4, width, target, opening = constants.rig, constants.pneumatic_gain, constants.sign_width, seen.asked, seen.opening
    for i in range(n):
        y1, y2, v1, v2 = joints.position[0, i], joints.position[1, i], joints.speed[0, i], joints.speed[1, i]
        pp1, pn1, pp2, pn2 = seen.pressure[0, i], seen.pressure[1, i], seen.pressure[2, i], seen.pressure[3, i]
        m, gravity, atmosphere = p.mass, p.gravity, p.atmosphere
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + 2.0 * r4 * w / s2 * v1

        fc1 = dry_friction.level_moving(0, v1, seen.pressure, i, p)
        fc2 = dry_friction.level_moving(1, v2, seen.pressure, i, p)
        drag1 = fc1 * smooth_sign(v1, width) + p.fv1 * v1
        drag2 = fc2 * smooth_sign(v2, width) + p.fv2 * v2
        load1 = mechanics.piston_force(pp1, pn1, p.area_p1, p.area_n1, atmosphere) - drag1
        load2 = mechanics.piston_force(pp2, pn2, p.area_p2, p.area_n2, atmosphere) - drag2
        ax, ay = cartesian(-load1 / (kappa * m), load2 / m, sine, cosine)
        ay -= gravity
        vx, vy = cartesian(-kappa * v1, v2, sine, cosine)

        ex, ey = r2 * sine - target.position[0, i], -r2 * cosine - target.position[1, i]
        dx, dy = vx - target.velocity[0, i], vy - target.velocity[1, i]
        kxx, kyy, kxy = target.stiffness[0, i] / m, target.stiffness[1, i] / m, target.stiffness_coupling[i] / m
        springx, springy = kxx * ex + kxy * ey, kxy * ex + kyy * ey
        cxx, cyy, cxy = square_root(3.0 * kxx - 2.0, 3.0 * kyy - 2.0, 3.0 * kxy)
        fx, fy = ax - target.acceleration[0, i] + springx, ay - target.acceleration[1, i] + springy
        drag_t = p.fv1 / (kappa * kappa * m) * across(springx, springy, sine, cosine)
        drag_n = p.fv2 / m * along(springx, springy, sine, cosine)
        jx = target.jerk[0, i] - 3.0 * (cxx * fx + cxy * fy) - (9.0 * kxx - 4.0) * dx - 9.0 * kxy * dy
        jy = target.jerk[1, i] - 3.0 * (cxy * fx + cyy * fy) - (9.0 * kyy - 4.0) * dy - 9.0 * kxy * dx
        jerk_t, jerk_n = across(jx, jy, sine, cosine) + drag_t, along(jx, jy, sine, cosine) + drag_n

        rate1, rate2 = load_rates(load1, load2, growth, turn, kappa, m * jerk_t, m * jerk_n)
        # The Coulomb term is taken to be constant: at rest the model's acceleration, which lacks the user's force, is not 0.
        rate1 += p.fv1 * mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p.inverse_mass, gravity)
        rate2 += p.fv2 * mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, p.inverse_mass, gravity)
        stiffness, stiffness_rate = target.pneumatic_stiffness, target.pneumatic_stiffness_rate
        first, second = air_at(0, pp1, pn1, y1, v1, p), air_at(1, pp2, pn2, y2, v2, p)
        opening[0, i], opening[1, i] = pressure_openings(rate1, stiffness[0, i], stiffness_rate[0, i], c4, first, p)
        opening[2, i], opening[3, i] = pressure_openings(rate2, stiffness[1, i], stiffness_rate[1, i], c4, second, p)


@kernel
def control(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are too soft."""
    missed, asked = 0, seen.asked
    for i in range(n):
        kx, ky, kxy = asked.stiffness[0, i], asked.stiffness[1, i], asked.stiffness_coupling[i]
        missed += 0 if is_stiffer(kx, ky, kxy, constants.least_stiffness) else 1
    law(seen, PistonEstimate(seen.intermediate[: PistonEstimate.size]).joints, constants, n)
    return missed
