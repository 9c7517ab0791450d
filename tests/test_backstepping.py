"""The backstepping law against its own derivation: f, g and F* of (13) from (5) in SymPy, chambers and valves solved numerically."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from baselines import BacksteppingController
from birthsim_env import mechanics
from birthsim_env.geometry import inverse_geometry, joint_force
from birthsim_env.lanes import Array
from birthsim_env.parameters import Cylinder, Parameters
from birthsim_env.signals import REFERENCES, Measurement, Reference
from tests import closed_loop
from tests import linkage_by_points as by_points

STATE = sp.symbols("y1 y2 v1 v2 F1 F2", real=True)
WANTED = sp.symbols("yd1 yd2 vd1 vd2 ad1 ad2 jd1 jd2", real=True)
GAINS = sp.symbols("c1 c2", positive=True)
BELIEVED = sp.symbols("b1 b2", real=True)
RIG = sp.symbols("m g d3 d6 gamma3 k1 k2 Fext1 Fext2 Fc1 Fc2 Fv1 Fv2 width compensate", real=True)
Y1, Y2, V1, V2, F1, F2 = STATE
MASS, GRAVITY, D3, D6, GAMMA3, K1, K2, FEXT1, FEXT2, FC1, FC2, FV1, FV2, WIDTH, COMPENSATE = RIG

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
def derived_law() -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Numeric functions of all symbols: z1, z2, z3, g of both cylinders; and the wanted dF/dt of both."""
    f1, g1, f2, g2 = model_13()
    errors, stars = [], []
    for i, (y, v, f, g) in enumerate(((Y1, V1, f1, g1), (Y2, V2, f2, g2))):
        yd, vd, ad, _ = WANTED[i::2]
        z1, z2 = y - yd, v - vd + GAINS[i] * (y - yd)
        stars.append((ad - GAINS[i] * (v - vd) - f - z1 - GAINS[i] * z2) / g)
        errors.append([z1, z2, STATE[4 + i] - stars[i], g])
    flow = {Y1: V1, Y2: V2, V1: f1 + g1 * F1, V2: f2 + g2 * F2}
    flow |= dict(zip(WANTED[:6], WANTED[2:], strict=True))
    rates = []
    for (_, z2, z3, g), star, gain in zip(errors, stars, GAINS, strict=True):
        rates.append(sum(star.diff(x) * rate for x, rate in flow.items()) - z2 / g - gain * z3)
    arguments = [*STATE, *WANTED, *GAINS, *BELIEVED, *RIG]
    return sp.lambdify(arguments, errors, cse=True), sp.lambdify(arguments, rates, cse=True)


def rig_values(rig: Parameters, width: float, compensate: bool) -> list[float]:
    """Values of ``RIG``."""
    g, c1, c2 = rig.geometry, rig.cylinder1, rig.cylinder2
    rod = [rig.air.atmospheric_pressure * math.pi / 4 * c.rod_diameter**2 for c in (c1, c2)]
    return [
        rig.mechanics.mass, rig.mechanics.gravity, g.d3, g.d6, g.gamma3, g.k1, g.k2, *rod,
        c1.coulomb_friction, c2.coulomb_friction, c1.viscous_friction, c2.viscous_friction, width, float(compensate),
    ]  # fmt: skip


def areas(cylinder: Cylinder) -> tuple[float, float]:
    bore = math.pi / 4 * cylinder.piston_diameter**2
    return bore, bore - math.pi / 4 * cylinder.rod_diameter**2


def gains_for(piston: Array, stiffness: Array, rig: Parameters) -> Array:
    """Largest roots of the cubic for the joint stiffness (18) of the linkage made of points, (2, N)."""
    r4, r2 = piston[0] + rig.geometry.k1, piston[1] + rig.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, rig.geometry)
    found = np.empty(piston.shape)
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        column, _ = by_points.cartesian_velocity(pose, r2, 1.0 - i, float(i))
        kcl, mass, viscous = (stiffness * column**2).sum(axis=0), rig.mechanics.mass * (column**2).sum(axis=0), cylinder.viscous_friction
        for lane, (k, m) in enumerate(zip(kcl, mass, strict=True)):
            found[i, lane] = np.roots([m, 0, 2 * m - 3 * k, k * viscous / m]).real.max()
    return found


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
    """ISO 6358 at ambient temperature, kg/s, either way."""
    up, b = max(p_from, p_to), rig.valves.critical_ratio
    ratio = min(p_from, p_to) / up
    if ratio <= b:
        psi = 1.0
    else:
        psi = math.sqrt(1 - ((min(ratio, 0.99) - b) / (1 - b)) ** 2)
        psi *= min(1.0, (1 - ratio) / 0.01)
    density = rig.air.reference_density * math.sqrt(rig.air.reference_temperature / rig.air.temperature)
    return math.copysign(conductance * density * up * psi, p_from - p_to)


def net_flow(opening: float, pressure: float, rig: Parameters) -> float:
    """Into a chamber: through the orifices to the supply and to the atmosphere, both leaking, kg/s."""
    c, leak = rig.valves.sonic_conductance, rig.valves.leakage_ratio
    supplied = orifice(c * (max(opening, 0.0) + leak), rig.air.supply_pressure, pressure, rig)
    return supplied - orifice(c * (max(-opening, 0.0) + leak), pressure, rig.air.atmospheric_pressure, rig)


def opening_for(flow: float, pressure: float, rig: Parameters) -> float:
    """Root of the characteristic, or the limit where the valve cannot carry the flow."""
    least, most = (net_flow(s, pressure, rig) for s in (-1.0, 1.0))
    if not least < flow < most:
        return 1.0 if flow >= most else -1.0
    return float(brentq(lambda s: net_flow(s, pressure, rig) - flow, -1, 1, xtol=1e-13, rtol=1e-14))


def pressures_for(force: Any, stiffness: Any, y: Any, cylinder: Cylinder, rig: Parameters) -> Array:
    """Pp and Pn at which (3) gives ``force`` and (9) gives ``stiffness``: two linear equations."""
    (ap, an), lp, ln = areas(cylinder), cylinder.stroke / 2 + y, cylinder.stroke / 2 - y
    push = (stiffness / rig.air.polytropic_index + force / ln) / (1 / lp + 1 / ln)
    return np.array([push / ap, (push - force) / an])


def random_situations(rig: Parameters, width: float, compensate: bool, lanes: int, rng: np.random.Generator) -> dict[str, Array]:
    """States near random references: F within some N of F*, K inside the range of the pressures, the valves not all shut."""
    half = np.array([[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]])
    s: dict[str, Array] = {}
    s["piston"] = 0.8 * half * rng.uniform(-1, 1, (2, lanes))
    s["speed"] = rng.choice([0.0, 0.003, 0.3], (2, lanes)) * rng.normal(0, 1, (2, lanes))
    noise = np.repeat([0.001, 0.01, 0.5, 20.0], 2)[:, None]
    s["wanted"] = np.concatenate([s["piston"], s["speed"], np.zeros((4, lanes))]) + noise * rng.normal(0, 1, (8, lanes))
    s["stiffness"] = rng.uniform(800, 4500, (2, lanes))
    s["believed"] = rng.normal(0, 20, (2, lanes))
    s["gains"] = gains_for(s["piston"], s["stiffness"], rig)
    s["pneumatic"] = rng.uniform([[2500], [1300]], [[5000], [2600]], (2, lanes))
    s["pneumatic_wanted"] = s["pneumatic"] + rng.normal(0, 50, (2, lanes))
    s["pneumatic_rate"] = rng.normal(0, 500, (2, lanes))
    values = rig_values(rig, width, compensate)
    errors, _ = derived_law()
    without_air = [*s["piston"], *s["speed"], 0.0, 0.0, *s["wanted"], *s["gains"], *s["believed"], *values]
    star = -np.array([errors(*without_air)[i][2] for i in (0, 1)])
    s["force"] = star + rng.normal(0, 3, (2, lanes))
    pressures = [
        pressures_for(s["force"][i], s["pneumatic"][i], s["piston"][i], cylinder, rig) for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2))
    ]
    s["pressures"] = np.concatenate(pressures)
    possible = np.all((s["pressures"] > 1.1e5) & (s["pressures"] < 6.9e5), axis=0)
    return {name: value[:, possible] for name, value in s.items()}


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


def as_signals(s: dict[str, Array], rig: Parameters) -> tuple[Measurement, Reference]:
    """A random situation as the controller meets it."""
    reference = cartesian(s["wanted"], rig)
    reference.rows[8:] = np.concatenate([s["stiffness"], s["pneumatic_wanted"], s["pneumatic_rate"]])
    return seen(s["piston"], s["speed"], s["pressures"], rig), reference


TILTED = Parameters().replace(
    {
        "geometry.gamma3": 1.2, "geometry.d3": 0.42, "geometry.d6": 0.21, "geometry.k1": 0.45, "mechanics.mass": 4.2,
        "cylinder1.viscous_friction": 55.0, "cylinder2.coulomb_friction": 22.0, "cylinder2.rod_diameter": 0.012,
        "air.temperature": 300.0, "air.polytropic_index": 1.3, "valves.critical_ratio": 0.4,
    }
)  # fmt: skip


def test_model_13_is_5_without_14() -> None:
    """f2~ is what Newton's law in polar coordinates has beyond a force along the beam, and what (13) leaves out of (5)."""
    turning = THETA1.diff(Y1) * V1
    assert sp.simplify(neglected() - (R2 * turning**2 + GRAVITY * sp.cos(THETA1))) == 0
    _, full2 = equation_5(F1, F2)
    _, _, f2, g2 = model_13()
    assert sp.simplify(full2 - (f2 + g2 * F2).subs({COMPENSATE: 0, BELIEVED[1]: 0}) - neglected()) == 0
    # And the plant's (5) is the paper's.
    load1, load2, cosine, sine = sp.symbols("load1 load2 cosine sine")
    full1, full2 = (a.subs({FEXT1: 0, FEXT2: 0, FC1: 0, FC2: 0, FV1: 0, FV2: 0}) for a in equation_5(load1, load2))
    angle = {sp.cos(THETA1): cosine, sp.sin(THETA1): sine}
    ours1 = mechanics.acceleration1.py_func(load1, V1, V2, R2, R4, W, ROOT**2, 2 * R2 * R4 / ROOT, sine, MASS, GRAVITY)
    ours2 = mechanics.acceleration2.py_func(load2, V1, R2, R4, ROOT**2, cosine, MASS, GRAVITY)
    assert sp.simplify(ours1 - full1.subs(angle)) == 0
    assert sp.simplify(ours2 - full2.subs(angle)) == 0


@pytest.mark.parametrize("compensate", [False, True], ids=["paper", "compensated"])
@pytest.mark.parametrize(("rig", "gain", "width"), [(Parameters(), 30.0, 0.01), (TILTED, 47.0, 0.004)], ids=["default", "tilted"])
def test_openings_are_those_of_the_derived_law(rig: Parameters, gain: float, width: float, compensate: bool) -> None:
    situation = random_situations(rig, width, compensate, 800, np.random.default_rng(7))
    controller = BacksteppingController(rig, compensate, pneumatic_gain=gain, sign_width=width)
    got = controller.command(*as_signals(situation, rig), situation["believed"])
    _, wanted_rates = derived_law()
    s = situation
    values = [*s["piston"], *s["speed"], *s["force"], *s["wanted"], *s["gains"], *s["believed"], *rig_values(rig, width, compensate)]
    force_rate = np.array(wanted_rates(*values))
    stiffness_rate = s["pneumatic_rate"] - gain * (s["pneumatic"] - s["pneumatic_wanted"])
    expected = np.empty_like(got)
    for lane in range(got.shape[1]):
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
            air, rates = s["pressures"][2 * i : 2 * i + 2, lane], np.array([force_rate[i, lane], stiffness_rate[i, lane]])
            flows = flows_for(rates, air, s["piston"][i, lane], s["speed"][i, lane], cylinder, rig)
            expected[2 * i : 2 * i + 2, lane] = [opening_for(q, p, rig) for q, p in zip(flows, air, strict=True)]
    unsaturated = np.all(np.abs(expected) < 1, axis=0)
    assert unsaturated.sum() >= 100 and (~unsaturated).any(), "both must have been met"
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-8)



def moving_target(time: float, rig: Parameters) -> tuple[Array, Reference]:
    """Sinusoids of both joints, (8, 1), and the reference that asks for them with 2000 N/m on both axes."""
    angles = np.array([3.0, 2.5]) * time + np.array([0.4, 1.0])
    shifted = [np.array([0.04, 0.06]) * np.array([3.0, 2.5]) ** k * np.sin(angles + k * np.pi / 2) for k in range(4)]
    wanted = np.concatenate(shifted)[:, None]
    reference = cartesian(wanted, rig)
    reference.rows[8:10], reference.rows[10:12] = 2000.0, closed_loop.PNEUMATIC_STIFFNESS
    return wanted, reference


def forces(x: Array, rig: Parameters) -> list[Any]:
    """(3) for a state of the control model, N."""
    return [x[4 + 2 * i] * ap - x[5 + 2 * i] * an for i, (ap, an) in enumerate(map(areas, (rig.cylinder1, rig.cylinder2)))]


def errors_of(time: float, x: Array, rig: Parameters, compensate: bool) -> tuple[Array, Array, Array]:
    """z1, z2, g z3 (3, 2) of both cylinders, their gains and their g, for a state of the control model."""
    wanted, reference = moving_target(time, rig)
    gains = gains_for(x[:2, None], reference.stiffness, rig)[:, 0]
    found = derived_law()[0](*x[:4], *forces(x, rig), *wanted[:, 0], *gains, 0.0, 0.0, *rig_values(rig, 0.01, compensate))
    z = np.array([[z1, z2, g * z3] for z1, z2, z3, g in found]).T
    return z, gains, np.array([g for *_, g in found])


def simulate(rig: Parameters, compensate: bool, seconds: float) -> Any:
    """The paper's control model under the law, errors at the start: SciPy's solution for y1, y2, v1, v2, Pp1, Pn1, Pp2, Pn2.

    Acceleration (13), or (5) with compensation; polytropic chambers (6); valves without lag, which carry what their
    characteristic says for the openings that the law returns.
    """
    f1, g1, f2, g2 = (e.subs(dict.fromkeys(BELIEVED, 0)) for e in model_13())
    acceleration = sp.lambdify([*STATE, *RIG], [f1 + g1 * F1, f2 + g2 * F2], cse=True)
    values, cylinders = rig_values(rig, 0.01, compensate), (rig.cylinder1, rig.cylinder2)
    law = BacksteppingController(rig, compensate, sign_width=0.01)

    def slope(time: float, x: Array) -> Array:
        openings = law.command(seen(x[:2, None], x[2:4, None], x[4:, None].copy(), rig), moving_target(time, rig)[1])[:, 0]
        assert np.all(np.abs(openings) < 1), "the proof holds while no valve is saturated"
        flows = [net_flow(s, p, rig) for s, p in zip(openings, x[4:], strict=True)]
        air = [chamber_rates(x[4 + j : 6 + j], flows[j : j + 2], x[i], x[2 + i], c, rig) for i, (j, c) in enumerate(zip((0, 2), cylinders, strict=True))]
        return np.array([*x[2:4], *acceleration(*x[:4], *forces(x, rig), *values), *air[0], *air[1]])

    wanted, reference = moving_target(0.0, rig)
    start = np.concatenate([wanted[:2, 0] + [0.001, -0.0015], wanted[2:4, 0] + [-0.02, 0.02], np.zeros(4)])
    for i, cylinder in enumerate(cylinders):
        z, _, g = errors_of(0.0, start, rig, compensate)
        star = forces(start, rig)[i] - z[2, i] / g[i]
        start[4 + 2 * i : 6 + 2 * i] = pressures_for(star + 2.0, reference.pneumatic_stiffness[i, 0], start[i], cylinder, rig)
    return solve_ivp(slope, (0, seconds), start, method="RK45", rtol=1e-8, atol=[1e-10] * 2 + [1e-9] * 2 + [1e-3] * 4, dense_output=True, max_step=2e-3)


@pytest.mark.parametrize("compensate", [False, True], ids=["paper", "compensated"])
def test_errors_decay_as_lyapunovs_function_says(compensate: bool) -> None:
    """z1' = z2 - c z1, z2' = g z3 - z1 - c z2, z3' = -z2/g - c z3 make V = (z1^2 + z2^2 + (g z3)^2)/2 fall as exp(-2 c t) at constant g.

    Cylinder 2 has a constant g. That of cylinder 1 varies with the pose (by 11 % here): its errors are compared with the same
    equations integrated at that g. Without viscous friction its gain is constant, as the law takes it to be.
    """
    rig, seconds = Parameters().replace({"cylinder1.viscous_friction": 0.0}), 0.16
    motion = simulate(rig, compensate, seconds)
    times = np.linspace(0, seconds, 81)
    path = [errors_of(t, motion.sol(t), rig, compensate) for t in times]
    v = np.array([(z**2).sum(axis=0) / 2 for z, _, _ in path])
    assert np.all(np.diff(v, axis=0) < 0)
    assert np.all(v[-1] < 1e-5 * v[0])
    gain = path[0][1][1]
    np.testing.assert_allclose(v[:, 1], v[0, 1] * np.exp(-2 * gain * times), rtol=1e-4)

    def error_equations(time: float, z: Array) -> list[float]:
        _, gains, g = errors_of(time, motion.sol(time), rig, compensate)
        return [z[1] - gains[0] * z[0], g[0] * z[2] - z[0] - gains[0] * z[1], -z[1] / g[0] - gains[0] * z[2]]

    z, _, g = path[0]
    alone = solve_ivp(error_equations, (0, seconds), [z[0, 0], z[1, 0], z[2, 0] / g[0]], t_eval=times, rtol=1e-8, atol=1e-14)
    followed = np.array([[*z[:2, 0], z[2, 0] / g[0]] for z, _, g in path]).T
    worst = np.abs(followed - alone.y).max(axis=1) / np.abs(alone.y).max(axis=1)
    np.testing.assert_array_less(worst, 1e-7)


def many(lanes: int) -> tuple[Measurement, Reference, Array]:
    """More situations than one block of lanes holds."""
    situation = random_situations(Parameters(), 0.01, True, 200, np.random.default_rng(3))
    measured, reference = as_signals(situation, Parameters())
    assert measured.time.size >= lanes
    return *of_lanes(measured, reference, slice(lanes)), situation["believed"][:, :lanes]


def of_lanes(measured: Measurement, reference: Reference, lanes: Any) -> tuple[Measurement, Reference]:
    """The same signals for some lanes, or for one rig without lanes where ``lanes`` is a number."""
    signals = (measured.time, measured.position, measured.position_time, measured.velocity, measured.pressures, measured.user_force)
    return Measurement(*(np.ascontiguousarray(a[..., lanes]) for a in signals), measured.sampled), Reference(np.ascontiguousarray(reference.rows[:, lanes]))


def test_one_rig_is_one_lane() -> None:
    measured, reference, believed = many(77)
    law = BacksteppingController(weight_compensation=True)
    together, without = law.command(measured, reference, believed), law.command(measured, reference)
    assert not np.array_equal(together, without)
    for lane in (0, 31, 32, 76):
        alone = law.command(*of_lanes(measured, reference, lane), believed[:, lane])
        assert alone.shape == (4,)
        assert np.array_equal(alone, together[:, lane])
        assert np.array_equal(law.command(*of_lanes(measured, reference, lane)), without[:, lane])


def test_lanes_do_not_know_of_each_other() -> None:
    measured, reference, believed = many(77)
    law = BacksteppingController()
    together = law.command(measured, reference, believed)
    order = np.random.default_rng(0).permutation(77)
    shuffled = law.command(*of_lanes(measured, reference, order), np.ascontiguousarray(believed[:, order]))
    assert np.array_equal(shuffled, together[:, order])
    measured.pressures[:, 40] = 3e5
    changed = law.command(measured, reference, believed)
    assert np.array_equal(np.delete(changed, 40, axis=1), np.delete(together, 40, axis=1))
    assert not np.array_equal(changed[:, 40], together[:, 40])


def test_the_law_has_no_memory_of_exact_measurements() -> None:
    measured, reference, _ = many(5)
    law = BacksteppingController()
    first = law.command(measured, reference)
    assert np.array_equal(law.command(measured, reference), first)
    law.reset(np.array([True, False, True, False, False]))
    law.reset()
    assert np.array_equal(law.command(measured, reference), first)


def test_a_piston_past_its_stroke_gets_finite_openings() -> None:
    """End stops give way a little and sensors have noise."""
    rig = Parameters()
    beyond = np.array([[1, -1, 1, -1], [1, 1, -1, -1]]) * np.array([[0.1005], [0.2005]])
    measured = seen(beyond, np.zeros((2, 4)), np.full((4, 4), 4e5), rig)
    openings = BacksteppingController(rig).command(measured, closed_loop.holding(measured.position, 2000.0))
    assert np.all(np.abs(openings) <= 1)


def test_believing_the_users_force_removes_the_compliance() -> None:
    """Pushed with 10 N on each axis: 5 mm at 2000 N/m; nothing where the law is told of it along the cylinders (17)."""
    rig = closed_loop.FRICTIONLESS
    reference = closed_loop.holding(np.array([[0.5, 0.5, 0.45, 0.45], [0.0, 0.0, 0.05, 0.05]]), 2000.0)
    plant, law = closed_loop.resting_at(reference, rig), BacksteppingController(rig, weight_compensation=True)
    told, push = np.array([0.0, 1.0, 0.0, 1.0]), np.full((2, 4), 10.0)

    def command(measured: Measurement, reference: Reference) -> Array:
        return law.command(measured, reference, told * joint_force(measured.user_force, plant.piston, rig))

    for _ in closed_loop.run(plant, command, lambda t: reference, lambda t: push * min(t / 0.5, 1.0), 2.0):
        pass
    moved = plant.end_effector()[:2] - reference.position
    print(moved*1e3)
    np.testing.assert_allclose(moved[:, told == 0], 0.005, rtol=0.01)
    np.testing.assert_allclose(moved[:, told == 1], 0, atol=0.00001)


@pytest.mark.parametrize("name", ["pneumatic_gain", "sign_width"])
@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf])
def test_options_that_cannot_be_are_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} = {value!r}; allowed: a positive number"):
        BacksteppingController(**{name: value})


def test_a_rig_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="parameters = 3; allowed"):
        BacksteppingController(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"nowhere\.toml"):
        BacksteppingController("nowhere.toml")


def test_signals_over_different_lanes_are_refused() -> None:
    """A compiled loop would read past the shorter array without a word."""
    measured, reference, believed = many(3)
    law, narrow = BacksteppingController(), slice(1)
    fewer, fewer_wanted = of_lanes(measured, reference, narrow)
    mixed = dataclasses.replace(measured, pressures=fewer.pressures), dataclasses.replace(measured, velocity=fewer.velocity)
    with pytest.raises(ValueError, match=r"measurement.pressures has shape \(4, 1\); allowed: \(4, 3\)"):
        law.command(mixed[0], reference)
    with pytest.raises(ValueError, match=r"measurement.velocity has shape \(2, 1\); allowed: \(2, 3\)"):
        law.command(mixed[1], reference)
    with pytest.raises(ValueError, match=r"reference.rows has shape \(14, 1\); allowed: \(14, 3\)"):
        law.command(measured, fewer_wanted)
    with pytest.raises(ValueError, match=r"reference.rows has shape \(8, 3\); allowed: \(14, 3\)"):
        law.command(measured, Reference(reference.rows[:8].copy()))
    for wrong in (believed[:, :1], believed[:1], believed[:, 0]):
        with pytest.raises(ValueError, match=r"believed_force has shape .*; allowed: \(2, 3\)"):
            law.command(measured, reference, wrong)
    assert law.command(measured, reference, believed.tolist()).shape == (4, 3)
