"""Mechanics (3), (5), (14), (17) and the end stops: against Lagrange, Newton's law between points, and energy."""

import math

import mpmath
import numpy as np
import pytest
import sympy as sp

from birthsim_env.physics import dynamics, geometry, mechanics
from birthsim_env.physics.compiled.lanes import PN1, PN2, PP1, PP2, V1, V2, Y1, Y2, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Cylinder, Friction, Parameters
from tests.oracles import linkage_by_points as by_points

FRICTIONLESS = {"coulomb_friction": 0.0, "viscous_friction": 0.0}
SLIPPERY = Parameters(
    cylinder1=Cylinder(**FRICTIONLESS), cylinder2=Cylinder(stroke=0.4, **FRICTIONLESS), friction=Friction(law="coulomb")
)
RIGS = {
    "default": SLIPPERY,
    "tilted pivot": SLIPPERY.replace({"geometry.gamma3": 1.2, "geometry.d3": 0.42, "geometry.d6": 0.21, "geometry.k1": 0.45}),
    "other mass and areas": SLIPPERY.replace(
        {
            **{"geometry.gamma3": -2.0, "mechanics.mass": 4.3, "mechanics.gravity": 1.62},
            **{"cylinder1.piston_diameter": 0.04, "cylinder2.rod_diameter": 0.02, "chambers.dead_volume": 2e-5},
        }
    ),
}
each_rig = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


def lagranges_equations() -> tuple[list[sp.Symbol], dict[str, sp.Expr], list[sp.Expr]]:
    """d/dt dL/dq' - dL/dq - f for a point mass at the end effector, coordinates r4 and r2: their symbols, w, S and theta1."""
    t = sp.symbols("t")
    d3, d6, gamma3, m, g, f1, f2, r4, r2, v1, v2, a1, a2 = sp.symbols("d3 d6 gamma3 m g f1 f2 r4 r2 v1 v2 a1 a2")
    q1, q2 = sp.Function("q1")(t), sp.Function("q2")(t)
    w = q1**2 - d3**2 - d6**2
    theta = gamma3 - sp.asin(w / (2 * d3 * d6))
    x, y = q2 * sp.sin(theta), -q2 * sp.cos(theta)
    lagrangian = m / 2 * (x.diff(t) ** 2 + y.diff(t) ** 2) - m * g * y
    named = [(q1.diff(t, 2), a1), (q2.diff(t, 2), a2), (q1.diff(t), v1), (q2.diff(t), v2), (q1, r4), (q2, r2)]
    equations = [(lagrangian.diff(q.diff(t)).diff(t) - lagrangian.diff(q) - f).subs(named) for q, f in ((q1, f1), (q2, f2))]
    triangle = {"w": w.subs(named), "S": sp.sqrt(4 * d3**2 * d6**2 - w**2).subs(named), "theta": theta.subs(named)}
    return [d3, d6, gamma3, m, g, f1, f2, r4, r2, v1, v2, a1, a2], triangle, equations


def test_equation_5_is_lagranges_equation() -> None:
    """With 40 digits at random points: the package's own lines, fed with symbols, satisfy Lagrange's equations."""
    symbols, q, equations = lagranges_equations()
    m, g, f1, f2, r4, r2, v1, v2 = symbols[3:-2]
    kappa = geometry.amplification.py_func(r2, r4, 1 / q["S"])
    ours1 = mechanics.acceleration1.py_func(f1, v1, v2, r2, r4, q["w"], q["S"] ** 2, kappa, sp.sin(q["theta"]), 1 / m, g)
    ours2 = mechanics.acceleration2.py_func(f2, v1, r2, r4, q["S"] ** 2, sp.cos(q["theta"]), 1 / m, g)
    accelerations = sp.lambdify(symbols[:-2], [ours1, ours2], "mpmath", cse=True)
    residuals = sp.lambdify(symbols, equations, "mpmath", cse=True)
    rng = np.random.default_rng(0)
    with mpmath.workdps(40):
        for _ in range(50):
            dimensions = rng.uniform([0.25, 0.15, -3], [0.5, 0.35, 3])
            r4_range = 1.05 * abs(dimensions[0] - dimensions[1]), 0.98 * (dimensions[0] + dimensions[1])
            loads, motion = rng.uniform([1, 0, -300, -300], [6, 12, 300, 300]), rng.uniform([0.2, -1, -1], [0.8, 1, 1])
            point = [mpmath.mpf(float(value)) for value in (*dimensions, *loads, rng.uniform(*r4_range), *motion)]
            found = accelerations(*point)
            assert max(abs(a) for a in found) > 0.1
            assert max(abs(r) for r in residuals(*point, *found)) < 1e-33


def moving_states(rig: Parameters, lanes: int, rng: np.random.Generator) -> Plant:
    """A plant with lanes anywhere inside the strokes, moving, with any pressures."""
    plant = Plant(rig, lanes)
    plant.state[Y1] = rng.uniform(-0.98, 0.98, lanes) * rig.cylinder1.stroke / 2
    plant.state[Y2] = rng.uniform(-0.98, 0.98, lanes) * rig.cylinder2.stroke / 2
    plant.state[[V1, V2]] = rng.uniform(-1.5, 1.5, (2, lanes))
    plant.state[[PP1, PN1, PP2, PN2]] = rng.uniform(1e5, 7e5, (4, lanes))
    return plant


def bore_force(cylinder: Cylinder, pp: Array, pn: Array, atmosphere: float) -> Array:
    """(3): what both chambers and, on the rod's section, the atmosphere exert on the piston."""
    bore, rod = math.pi * cylinder.piston_diameter**2 / 4, math.pi * cylinder.rod_diameter**2 / 4
    return pp * bore - pn * (bore - rod) - atmosphere * rod


@each_rig
def test_newtons_law_holds_at_the_end_effector(rig: Parameters) -> None:
    """m a = rod forces along the rods of the linkage made of points + weight + user force."""
    lanes, rng = 300, np.random.default_rng(1)
    plant = moving_states(rig, lanes, rng)
    user = rng.uniform(-200, 200, (2, lanes))
    s = plant.state
    rates = plant.derivatives(s, np.zeros((4, lanes)), user)
    r4, r2 = s[Y1] + rig.geometry.k1, s[Y2] + rig.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, rig.geometry)
    acceleration = by_points.cartesian_acceleration(pose, r4, r2, s[V1], s[V2], rates[V1], rates[V2])
    force1 = bore_force(rig.cylinder1, s[PP1], s[PN1], rig.air.atmospheric_pressure)
    force2 = bore_force(rig.cylinder2, s[PP2], s[PN2], rig.air.atmospheric_pressure)
    force = by_points.newton_force(pose, r2, force1, force2) + user
    force[1] -= rig.mechanics.mass * rig.mechanics.gravity
    np.testing.assert_allclose(rig.mechanics.mass * acceleration, force, rtol=0, atol=1e-11 * 1000)
    assert np.array_equal(rates[[Y1, Y2]], s[[V1, V2]])


def test_weight_and_centrifugal_terms_14() -> None:
    """At rest without pressure difference the mass falls freely; turning alone pulls cylinder 2 out with m r2 omega^2."""
    plant = moving_states(SLIPPERY, 50, np.random.default_rng(2))
    atmosphere = SLIPPERY.air.atmospheric_pressure
    plant.state[[PP1, PN1, PP2, PN2]] = atmosphere
    plant.state[V2] = 0
    s, still = plant.state, plant.state.copy()
    still[[V1, V2]] = 0
    none = np.zeros((4, 50)), np.zeros((2, 50))
    r4, r2 = s[Y1] + SLIPPERY.geometry.k1, s[Y2] + SLIPPERY.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, SLIPPERY.geometry)
    rates = plant.derivatives(still, *none)
    falling = by_points.cartesian_acceleration(pose, r4, r2, 0.0, 0.0, rates[V1], rates[V2])
    np.testing.assert_allclose(falling, np.repeat([[0.0], [-9.81]], 50, axis=1), atol=1e-12)
    _, turning = by_points.cartesian_velocity(pose, r2, s[V1], s[V2])
    np.testing.assert_allclose(plant.derivatives(s, *none)[V2] - rates[V2], r2 * turning**2, rtol=1e-11)


@each_rig
def test_user_force_enters_as_its_own_acceleration(rig: Parameters) -> None:
    lanes, rng = 200, np.random.default_rng(5)
    plant = moving_states(rig, lanes, rng)
    user, s, closed = rng.uniform(-200, 200, (2, lanes)), plant.state, np.zeros((4, lanes))
    pushed = plant.derivatives(s, closed, user) - plant.derivatives(s, closed, np.zeros((2, lanes)))
    pose = by_points.pose_from_lengths(s[Y1] + rig.geometry.k1, s[Y2] + rig.geometry.k2, rig.geometry)
    added, _ = by_points.cartesian_velocity(pose, s[Y2] + rig.geometry.k2, pushed[V1], pushed[V2])
    np.testing.assert_allclose(rig.mechanics.mass * added, user, rtol=0, atol=1e-10)


def test_stop_force_is_zero_inside_a_spring_damper_past_it_and_never_pulls() -> None:
    stiffness, damping, half = 5e6, 1.0, 0.1
    force = mechanics.stop_force
    for y in np.linspace(-half, half, 41):
        assert force(y, 3.0, half, stiffness, damping) == 0 == force(y, -3.0, half, stiffness, damping)
    # 0.1 mm deep: 500 N held, 600 N driven in at 0.2 m/s, 400 N on the way back; mirrored at the near stop.
    for outward, newtons in ((0.0, 500.0), (0.2, 600.0), (-0.2, 400.0), (-1.0, 0.0), (-30.0, 0.0)):
        assert force(half + 1e-4, outward, half, stiffness, damping) == pytest.approx(newtons, abs=1e-8)
        assert force(-half - 1e-4, -outward, half, stiffness, damping) == pytest.approx(-newtons, abs=1e-8)


def free_flight(speed: float, stop_damping: float = 1.0) -> Plant:
    """Cylinder 2 without weight, friction or pressure difference, 1 mm before the stop that ``speed`` runs into."""
    rig = SLIPPERY.replace({"mechanics.gravity": 0.0, "valves.leakage_ratio": 0.0, "mechanics.stop_damping": stop_damping})
    plant = Plant(rig, 1)
    plant.state[[PP1, PN1, PP2, PN2]] = rig.air.atmospheric_pressure
    plant.state[Y2], plant.state[V2] = math.copysign(0.199, speed), speed
    return plant


@pytest.mark.parametrize("speed", [0.2, 0.6, -0.6])
@pytest.mark.parametrize("stop_damping", [0.0, 1.0])
def test_rebound_keeps_the_energy_that_hunt_and_crossley_leave(speed: float, stop_damping: float) -> None:
    """Integrating m v dv/dp = -k p (1 + c v) from contact to release relates the speeds by v/c - ln(1 + c v)/c^2."""
    plant, none = free_flight(speed, stop_damping), (np.zeros((4, 1)), np.zeros((1, 2, 1)))
    outward, depth = [], []
    for _ in range(1500):
        dynamics.advance(plant.state, *none, plant.lane_parameters, 5, 2e-6, plant.impacts)
        outward.append(plant.state[V2, 0] * math.copysign(1, speed))
        depth.append(abs(plant.state[Y2, 0]) - 0.2)
    touching = np.flatnonzero(np.array(depth) > 0)
    into, rebound = outward[touching[0]], -outward[touching[-1]]
    assert depth[-1] < 0
    assert into == pytest.approx(abs(speed), rel=0.02)
    if stop_damping == 0:
        assert rebound == pytest.approx(into, rel=0.005)
    else:
        assert rebound < 0.95 * into
        assert -rebound - math.log1p(-rebound) == pytest.approx(into - math.log1p(into), rel=0.01)


@pytest.mark.parametrize("speed", [0.1, 0.5, -0.5, 1.5])
def test_collision_is_reported_with_its_speed(speed: float) -> None:
    plant = free_flight(speed)
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.5 * 1e-3 / abs(speed))
    assert np.all(plant.impacts == 0), "not there yet"
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.01)
    assert plant.impacts[1, 0] == pytest.approx(abs(speed), rel=0.1)
    assert plant.impacts[0, 0] == 0
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.001)
    assert np.all(plant.impacts == 0), "only the last advance counts"


def test_leaving_a_stop_is_no_collision() -> None:
    plant = free_flight(0.3)
    plant.state[Y2], plant.state[V2] = 0.2001, -0.3
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.005)
    assert plant.state[Y2, 0] < 0.2
    assert np.all(plant.impacts == 0)


def test_piston_held_against_the_stop_rests_on_its_spring() -> None:
    rig = Parameters().replace({"mechanics.gravity": 0.0})
    plant = Plant(rig, 1)
    plant.state[Y2] = 0.199
    push = np.array([[0.0], [0.0], [1.0], [-1.0]])
    plant.advance(push, np.zeros((2, 1)), 2.0)
    s = plant.state[:, 0]
    force = bore_force(rig.cylinder2, s[PP2], s[PN2], rig.air.atmospheric_pressure)
    assert force > 250, "about 295 N (Table I)"
    assert abs(s[V2]) < 1e-6
    carried = rig.mechanics.stop_stiffness * (s[Y2] - 0.2)
    assert carried == pytest.approx(force, abs=20.0), "but for stiction, at most 20 N"
