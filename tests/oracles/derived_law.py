"""The backstepping law derived anew: f, g and F* of (13) from (5) in SymPy, chambers and valves as equations to be solved.

Nothing of the package's formulas is used; ``BacksteppingController`` is compared with this.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from birthsim_env.loop.signals import REFERENCES, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Cylinder, Parameters
from lab.studies.accuracy import second_model
from tests.oracles import linkage_by_points as by_points

STATE = sp.symbols("y1 y2 v1 v2 F1 F2", real=True)
WANTED = sp.symbols("yd1 yd2 vd1 vd2 ad1 ad2 jd1 jd2", real=True)
GAINS = sp.symbols("c11 c12 c13 c21 c22 c23", positive=True)
"""c1, c2, c3 of cylinder 1, then of cylinder 2."""
BELIEVED = sp.symbols("b1 b2", real=True)
BELIEVED_RATE = sp.symbols("db1 db2", real=True)
RIG = sp.symbols("m g d3 d6 gamma3 k1 k2 Fext1 Fext2 Fc1 Fc2 Fv1 Fv2 width compensate sliding", real=True)
Y1, Y2, V1, V2, F1, F2 = STATE
MASS, GRAVITY, D3, D6, GAMMA3, K1, K2, FEXT1, FEXT2, FC1, FC2, FV1, FV2, WIDTH, COMPENSATE, SLIDING = RIG

R4, R2 = Y1 + K1, Y2 + K2
W = R4**2 - D3**2 - D6**2
ROOT = sp.sqrt(4 * D3**2 * D6**2 - W**2)
THETA1 = GAMMA3 - sp.asin(W / (2 * D3 * D6))


def drag(speed: sp.Expr, coulomb: sp.Expr, viscous: sp.Expr) -> sp.Expr:
    """(4) with the smoothed sign that the law states."""
    return coulomb * speed / sp.sqrt(speed**2 + WIDTH**2) + viscous * speed


def neglected() -> sp.Expr:
    """f2~ of (14): centrifugal acceleration and weight projection."""
    return 4 * R2 * R4**2 * V1**2 / (4 * D3**2 * D6**2 - W**2) + GRAVITY * sp.cos(THETA1)


def equation_5(force1: sp.Expr, force2: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """dv1/dt and dv2/dt as the paper prints them; d6 cos(theta7) = S/(2 r4) is the lever arm of cylinder 1."""
    lever = ROOT / (2 * R4)
    outward = drag(V1, FC1, FV1) + FEXT1 - force1
    dv1 = ROOT / (2 * R2 * R4) * (GRAVITY * sp.sin(THETA1) - lever / (MASS * R2) * outward)
    dv1 -= 2 * R4 * W * V1**2 / ROOT**2 + 2 * V1 * V2 / R2 + V1**2 / R4
    dv2 = (force2 - FEXT2 - drag(V2, FC2, FV2)) / MASS + GRAVITY * sp.cos(THETA1)
    return dv1, dv2 + 4 * R2 * R4**2 * V1**2 / (4 * D3**2 * D6**2 - W**2)


def model_13() -> tuple[sp.Expr, sp.Expr, sp.Expr, sp.Expr]:
    """f1, g1, f2, g2 of (13) for v' = f + g F; f2 has f2~ only where the law compensates for it."""
    full1, full2 = equation_5(F1, F2)
    g1, g2 = full1.diff(F1), full2.diff(F2)
    f1, f2 = full1.subs(F1, 0), full2.subs(F2, 0) - (1 - COMPENSATE) * neglected()
    return f1 + g1 * BELIEVED[0], g1, f2 + g2 * BELIEVED[1], g2


@cache
def errors_and_rates() -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Numeric functions of all symbols but ``BELIEVED_RATE``: z1, z2, z3, g of both cylinders; and of all symbols, with those
    rates last: the wanted dF/dt of both."""
    f1, g1, f2, g2 = model_13()
    flow = {Y1: V1, Y2: V2, V1: f1 + g1 * F1, V2: f2 + g2 * F2}
    flow |= dict(zip(WANTED[:6], WANTED[2:], strict=True)) | dict(zip(BELIEVED, BELIEVED_RATE, strict=True))
    errors, rates = [], []
    for i, (y, v, f, g, coulomb) in enumerate(((Y1, V1, f1, g1, FC1), (Y2, V2, f2, g2, FC2))):
        (yd, vd, ad, _), (c1, c2, c3) = WANTED[i::2], GAINS[3 * i : 3 * i + 3]
        z1, z2 = y - yd, v - vd + c1 * (y - yd)
        star = (ad - c1 * (v - vd) - f - z1 - c2 * z2) / g
        z3 = STATE[4 + i] - star
        errors.append([z1, z2, z3, g])
        along_model = sum(star.diff(x) * rate for x, rate in flow.items())
        frozen = (1 - SLIDING) * drag(v, coulomb, 0).diff(v) * flow[v]
        rates.append(along_model - frozen - z2 / g - c3 * z3)
    arguments = [*STATE, *WANTED, *GAINS, *BELIEVED, *RIG]
    return sp.lambdify(arguments, errors, cse=True), sp.lambdify([*arguments, *BELIEVED_RATE], rates, cse=True)


def coulomb_levels(pressures: Any, speed: Any, rig: Parameters) -> list[Any]:
    """Coulomb friction of both pistons, N, at the pressures of chambers P1, N1, P2, N2 and the way in which each moves."""
    levels = []
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        gauge = pressures[2 * i] + pressures[2 * i + 1] - 2 * rig.air.atmospheric_pressure
        way = np.where(np.asarray(speed[i]) > 0, 1, -1)
        pressed = np.maximum(cylinder.coulomb_friction + cylinder.pressure_friction * gauge, 0)
        levels.append(pressed * (1 + cylinder.direction_asymmetry * way))
    return levels


def rig_values(rig: Parameters, width: float, compensate: bool, frozen: bool = False, coulomb: Any = (None, None)) -> list[Any]:
    """Values of ``RIG``; ``frozen`` leaves the Coulomb friction out of dF*/dt.

    ``coulomb`` are the ``coulomb_levels`` at hand, which laws take as constant in dF*/dt; else those of seals without pressure.
    """
    g, c1, c2 = rig.geometry, rig.cylinder1, rig.cylinder2
    levels = [c.coulomb_friction if level is None else level for c, level in zip((c1, c2), coulomb, strict=True)]
    rod = [rig.air.atmospheric_pressure * math.pi / 4 * c.rod_diameter**2 for c in (c1, c2)]
    return [
        rig.mechanics.mass, rig.mechanics.gravity, g.d3, g.d6, g.gamma3, g.k1, g.k2, *rod,
        *levels, c1.viscous_friction, c2.viscous_friction,
        width, float(compensate), float(not frozen),
    ]  # fmt: skip


def areas(cylinder: Cylinder) -> tuple[float, float]:
    bore = math.pi / 4 * cylinder.piston_diameter**2
    return bore, bore - math.pi / 4 * cylinder.rod_diameter**2


def gains_for(piston: Array, stiffness: Array, rig: Parameters, ratio: float | None = None) -> Array:
    """Gains, (6, N), for the joint stiffness (18) of the linkage made of points.

    Equal, the largest roots of the cubic, or with a damping ratio the larger c1 = c3 at which K and B s, the impedance's first
    two terms, are as asked.
    """
    r4, r2 = piston[0] + rig.geometry.k1, piston[1] + rig.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, rig.geometry)
    found = np.empty((6, piston.shape[1]))
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        column, _ = by_points.cartesian_velocity(pose, r2, 1.0 - i, float(i))
        kcl, mass, viscous = (
            (stiffness * column**2).sum(axis=0),
            rig.mechanics.mass * (column**2).sum(axis=0),
            cylinder.viscous_friction,
        )
        for lane, (k, m) in enumerate(zip(kcl, mass, strict=True)):
            rows = slice(3 * i, 3 * i + 3)
            if ratio is None:
                found[rows, lane] = np.roots([m, 0, 2 * m - 3 * k, k * viscous / m]).real.max()
            else:
                found[rows, lane] = damped_gains(k, 2 * ratio * math.sqrt(k * m), m, viscous)
    return found


def damped_gains(stiffness: float, damping: float, mass: float, viscous: float) -> tuple[float, float, float]:
    """c1 = c3 and c2 by bracketing c1 above the minimum of B; c2 from K, which is linear in it."""

    def inner(q: Any) -> Any:
        # m (2 q + q^2 c2) = K (2 q + c2 - Fv/m)
        return (stiffness * (2 * q - viscous / mass) - 2 * mass * q) / (mass * q * q - stiffness)

    def excess(q: Any) -> Any:
        pole = 2 * q + inner(q) - viscous / mass
        return (mass * (q * q + 2 * q * inner(q) + 2) - stiffness) / pole - damping

    grid = math.sqrt(stiffness / mass) * np.geomspace(1.001, 100, 500)
    least = grid[int(np.argmin(excess(grid)))]
    q = float(brentq(excess, least, grid[-1], xtol=1e-13, rtol=1e-14))
    return q, inner(q), q


def chamber_rates(air: Any, flow: Any, y: float, v: float, cylinder: Cylinder, rig: Parameters) -> tuple[float, float]:
    """(6): dPp/dt and dPn/dt."""
    (ap, an), k, gas_t = areas(cylinder), rig.air.polytropic_index, rig.air.gas_constant * rig.air.temperature
    lp, ln = cylinder.stroke / 2 + y, cylinder.stroke / 2 - y
    return k * (gas_t * flow[0] - air[0] * ap * v) / (ap * lp), k * (gas_t * flow[1] + air[1] * an * v) / (an * ln)


def force_and_stiffness_rates(air: Any, flow: Any, y: float, v: float, cylinder: Cylinder, rig: Parameters) -> Array:
    """dF/dt of (3) and dK/dt of (9) along (6)."""
    (ap, an), k = areas(cylinder), rig.air.polytropic_index
    lp, ln = cylinder.stroke / 2 + y, cylinder.stroke / 2 - y
    dpp, dpn = chamber_rates(air, flow, y, v, cylinder, rig)
    stiffness_rate = k * (ap * (dpp / lp - air[0] * v / lp**2) + an * (dpn / ln + air[1] * v / ln**2))
    return np.array([ap * dpp - an * dpn, stiffness_rate])


def flows_for(rates: Array, air: Any, y: float, v: float, cylinder: Cylinder, rig: Parameters) -> Array:
    """qp and qn that give dF/dt and dK/dt: two linear equations."""
    still = force_and_stiffness_rates(air, (0.0, 0.0), y, v, cylinder, rig)
    unit = [force_and_stiffness_rates(air, q, y, v, cylinder, rig) - still for q in ((1.0, 0.0), (0.0, 1.0))]
    return np.linalg.solve(np.transpose(unit), rates - still)


def orifice(conductance: float, p_from: float, p_to: float, rig: Parameters) -> float:
    """ISO 6358 at ambient temperature, kg/s, either way, by the second model."""
    air, up, down = rig.air, max(p_from, p_to), min(p_from, p_to)
    reference = rig.valves.critical_ratio, air.reference_density, air.reference_temperature
    return math.copysign(second_model.orifice(conductance, up, air.temperature, down, *reference), p_from - p_to)


def net_flow(opening: float, pressure: float, rig: Parameters) -> float:
    """Into a chamber whose valve has the curve that all share: through both orifices, which leak, kg/s."""
    v = rig.valves
    to_supply = second_model.opened(opening, np.array([v.supply_overlap, v.supply_curvature, 1.0]))
    to_exhaust = second_model.opened(-opening, np.array([v.exhaust_overlap, v.exhaust_curvature, v.exhaust_ratio]))
    supplied = orifice(v.sonic_conductance * (to_supply + v.leakage_ratio), rig.air.supply_pressure, pressure, rig)
    leaving = v.sonic_conductance * (to_exhaust + v.leakage_ratio)
    return supplied - orifice(leaving, pressure, rig.air.atmospheric_pressure, rig)


def exact_opening_for(flow: float, pressure: float, rig: Parameters) -> float:
    """Root of the characteristic, or the limit where the valve cannot carry the flow."""
    least, most = (net_flow(s, pressure, rig) for s in (-1.0, 1.0))
    if not least < flow < most:
        return 1.0 if flow >= most else -1.0
    return float(brentq(lambda s: net_flow(s, pressure, rig) - flow, -1, 1, xtol=1e-13, rtol=1e-14))


def opening_for(flow: float, pressure: float, rig: Parameters) -> float:
    """``exact_opening_for`` less the part of the overlap that a controller leaves out while it crosses it (docs/valves.md)."""
    v, exact = rig.valves, exact_opening_for(flow, pressure, rig)
    supply, exhaust = (v.supply_overlap, v.supply_curvature, 1.0), (v.exhaust_overlap, v.exhaust_curvature, v.exhaust_ratio)
    edge = np.array(supply if exact > 0 else exhaust)
    left_out = edge[0] * max(1 - second_model.opened(abs(exact), edge) / v.crossing, 0) ** 2
    return exact - math.copysign(left_out, exact)


def pressures_for(force: Any, stiffness: Any, y: Any, cylinder: Cylinder, rig: Parameters) -> Array:
    """Pp and Pn at which (3) gives ``force`` and (9) gives ``stiffness``: two linear equations."""
    (ap, an), lp, ln = areas(cylinder), cylinder.stroke / 2 + y, cylinder.stroke / 2 - y
    push = (stiffness / rig.air.polytropic_index + force / ln) / (1 / lp + 1 / ln)
    return np.array([push / ap, (push - force) / an])


def air_for(force: Array, stiffness: Array, piston: Array, rig: Parameters) -> Array:
    """``pressures_for`` of both cylinders, (4, ...), from (2, ...)."""
    each = zip(force, stiffness, piston, (rig.cylinder1, rig.cylinder2), strict=True)
    return np.concatenate([pressures_for(*one, rig) for one in each])


@cache
def direct_derivatives() -> Callable[..., Any]:
    """x, y to their jerks for a motion of the joints: the Taylor series of (1) and the end effector, in SymPy."""
    t = sp.symbols("t")
    names = [sp.Symbol(f"q{i}{k}") for k in range(4) for i in (0, 1)]
    along1, along2 = (sum(q * t**k / sp.factorial(k) for k, q in enumerate(names[i::2])) for i in (0, 1))
    angle = THETA1.subs(Y1, along1)
    point = [(along2 + K2) * sp.sin(angle), -(along2 + K2) * sp.cos(angle)]
    derivatives = [axis.diff(t, k).subs(t, 0) for k in range(4) for axis in point]
    return sp.lambdify([*names, D3, D6, GAMMA3, K1, K2], derivatives, cse=True)


def cartesian(wanted: Array, rig: Parameters) -> Reference:
    """A reference whose target (rows 0 to 7) is that of the joints, ``wanted`` (8, N)."""
    g = rig.geometry
    rows = np.zeros((REFERENCES, wanted.shape[1]))
    rows[:8] = direct_derivatives()(*wanted, g.d3, g.d6, g.gamma3, g.k1, g.k2)
    return Reference(rows)


def seen(piston: Array, speed: Array, pressures: Array, rig: Parameters) -> Measurement:
    """Exact sensors on the linkage made of points."""
    r2, clock = piston[1] + rig.geometry.k2, np.zeros(piston.shape[1])
    pose = by_points.pose_from_lengths(piston[0] + rig.geometry.k1, r2, rig.geometry)
    velocity, _ = by_points.cartesian_velocity(pose, r2, *speed)
    return Measurement(clock, pose.end_effector, clock, velocity, pressures, np.zeros(piston.shape), sampled=False)


def accelerations(rig: Parameters, width: float, compensate: bool, coulomb: Any = (None, None)) -> Callable[..., Any]:
    """(13), or (5) with compensation, as a function of ``STATE``: dv1/dt and dv2/dt without a force that is only believed.

    ``coulomb`` as in ``rig_values``.
    """
    f1, g1, f2, g2 = (e.subs(dict.fromkeys(BELIEVED, 0)) for e in model_13())
    function = sp.lambdify([*STATE, *RIG], [f1 + g1 * F1, f2 + g2 * F2], cse=True)
    values = rig_values(rig, width, compensate, coulomb=coulomb)
    return lambda *state: function(*state, *values)


def forces(pressures: Any, rig: Parameters) -> list[Any]:
    """(3) for the pressures of chambers P1, N1, P2, N2, N."""
    (p1, n1), (p2, n2) = areas(rig.cylinder1), areas(rig.cylinder2)
    return [pressures[0] * p1 - pressures[1] * n1, pressures[2] * p2 - pressures[3] * n2]
