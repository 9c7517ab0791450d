"""What the nonlinear MPC expects of the rig: Newton, polytropic chambers and SciPy along the horizon; its programme."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from baselines.rivals import horizon
from baselines.rivals.horizon import FLOWS, FORCES, HALF, NODES, OUTPUTS, POINTS, SIZE, STATE, Horizon, HorizonInputs
from baselines.rivals.symbolic import ALGEBRAS, symbolic_model
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column, parameter_columns
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import derived_law, rigid_body
from tests.oracles import linkage_by_points as by_points
from tests.physics.rigs import TILTED

TOLERANCES = {"position": 2e-4, "speed": 7e-3, "stiffness": 250.0, "flow": 3e-3}
STEPS = np.array([0.002, 0.003, 0.002, 0.007, 0.004, 0.012, 0.009])
PRESSURE, FLOW = 1e5, 1e-3
"""Pa, kg/s: what pressures and flows of the second model are counted in."""

UNITS = np.repeat([1.0, PRESSURE], [4, 4])

on_both_rigs = pytest.mark.parametrize("rig", [Parameters(), TILTED], ids=["default", "tilted"])


def states(rig: Parameters, count: int, seed: int, speed: float = 0.3, push: float = 40.0) -> Array:
    """Random states (8, N), near balance, pressures in PRESSURE."""
    now = rigid_body.near_balance(rig, count, seed, speed, push)
    return np.concatenate([now.piston, now.speed, now.pressures / PRESSURE])


def second_rates(state: Array, flows: Array, force: Array, disturbance_force: Array, rig: Parameters) -> Array:
    """d(state)/dt (8,): Newton's law for the mass in Cartesian coordinates; dp/p = k (dm/m - dV/V) in chambers."""
    piston, speed, pressures = state[:2, None], state[2:4, None], PRESSURE * state[4:]
    along = rigid_body.forces(pressures[:, None], rig)
    cartesian = rigid_body.acceleration(piston, speed, along, rig, disturbance_force[:, None], force[:, None])
    bend = rigid_body.joint_acceleration(piston, speed, cartesian, rig)[:, 0]
    air, rates = rig.air, []
    for chamber, pressure in enumerate(pressures):
        i, side = divmod(chamber, 2)
        cylinder, sign = (rig.cylinder1, rig.cylinder2)[i], 1 - 2 * side
        area = derived_law.areas(cylinder)[side]
        volume = rig.chambers.dead_volume + area * (cylinder.stroke / 2 + sign * state[i])
        mass = pressure * volume / (air.gas_constant * air.temperature)
        growth = FLOW * flows[chamber] / mass - sign * area * state[2 + i] / volume
        rates.append(air.polytropic_index * pressure * growth / PRESSURE)
    return np.array([*speed[:, 0], *bend, *rates])


def seen_from_outside(state: Array, rig: Parameters) -> Array:
    """x, y, vx, vy of the linkage made of points, and the pneumatic stiffnesses (9): how forces fall where no air flows."""
    piston, speed = state[:2, None], state[2:4, None]
    pose = rigid_body.pose_of(piston, rig)
    velocity, _ = by_points.cartesian_velocity(pose, piston[1] + rig.geometry.k2, *speed)
    found, step = [*pose.end_effector[:, 0], *velocity[:, 0]], 1e-6
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        areas, half, y = derived_law.areas(cylinder), cylinder.stroke / 2, state[i]
        columns, pressures = np.array([half + y, half - y]), PRESSURE * state[4 + 2 * i : 6 + 2 * i]

        def force(shift: float, held: Any = (areas, columns, pressures)) -> float:
            areas, columns, pressures = held
            squeezed = pressures * (columns / (columns + np.array([shift, -shift]))) ** rig.air.polytropic_index
            return float(np.dot(squeezed, [areas[0], -areas[1]]))

        found.append((force(-step) - force(step)) / (2 * step))
    return np.array(found)


@on_both_rigs
def test_rates_are_those_of_newton_and_polytropic_chambers(rig: Parameters) -> None:
    """With dead volume, a user's force and forces unseen; random states, every row to 1e-9 of its size."""
    rng, state = np.random.default_rng(1), states(rig, 40, 0)
    flows, pushes = rng.normal(0, 2, (FLOWS, 40)), rng.normal(0, 25, (FORCES, 40))
    found, p = np.empty((STATE, 40)), Rig(parameter_column(rig))
    for lane in range(40):
        horizon.rates(state * UNITS[:, None], FLOW * flows, pushes, p, found, lane)
    expected = np.array(
        [second_rates(*lane[:2], *np.split(lane[2], 2), rig) for lane in zip(state.T, flows.T, pushes.T, strict=True)]
    )
    size = np.abs(expected).max(axis=0)
    assert np.all(size > [0.1, 0.1, 5, 5, 5, 5, 5, 5])
    np.testing.assert_allclose(found.T / UNITS / size, expected / size, rtol=0, atol=1e-9)


def numeric(rig: Parameters, algebra: str) -> Any:
    """The symbolic model as a function of state, flows and forces, in SI units, that returns rates and outputs (14,)."""
    of = pytest.importorskip(algebra)
    model = symbolic_model(rig, algebra)
    symbols = [model.state, model.flow, model.force]
    if algebra == "sympy":
        made = of.lambdify([list(one) for one in symbols], [*model.rates, *model.outputs])
        return lambda *given: np.array(made(*given), dtype=float)
    made = of.Function("model", symbols, [of.vertcat(model.rates, model.outputs)])
    return lambda *given: np.array(made(*given))[:, 0]


@on_both_rigs
@pytest.mark.parametrize("algebra", ALGEBRAS)
def test_symbols_are_the_second_model_too(rig: Parameters, algebra: str) -> None:
    rng, state = np.random.default_rng(1), states(rig, 5, 0)
    flows, pushes, found_by = rng.normal(0, 2, (FLOWS, 5)), rng.normal(0, 25, (FORCES, 5)), numeric(rig, algebra)
    for lane in range(5):
        now, flow, push = state[:, lane], flows[:, lane], pushes[:, lane]
        found = found_by(now * UNITS, FLOW * flow, push)
        np.testing.assert_allclose(found[:8] / UNITS, second_rates(now, flow, *np.split(push, 2), rig), rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(found[8:], seen_from_outside(now, rig), rtol=1e-7, atol=1e-9)


def about(rig: Parameters, steps: Array, weight: Array) -> Horizon:
    kept = np.exp(-steps / 2 / rig.valves.time_constant)
    return Horizon(Horizon.numbers(tick=np.zeros(NODES), step=steps, kept=kept, weight=weight, **TOLERANCES))


def stepped(rig: Parameters, state: Array, flows: Array, commanded: Array, pushes: Array, time: float, count: int = 1) -> Array:
    """State and flows (12, N) in their units after ``count`` steps of ``time``, s; ``pushes`` (4, N)."""
    lanes = state.shape[1]
    now, flowing, plan = state * UNITS[:, None], FLOW * flows, np.zeros((SIZE, lanes))
    plan[:FLOWS] = FLOW * commanded
    rows, of = parameter_columns(rig, lanes), about(rig, np.full(NODES, time), np.ones(NODES))
    points, total, q = np.empty((POINTS, lanes)), np.empty((STATE, lanes)), np.empty((FLOWS, lanes))
    for _ in range(count):
        horizon.step_to(now, flowing, plan, np.array(pushes), rows, 0, of, points, total, q, lanes)
    return np.concatenate([now / UNITS[:, None], flowing / FLOW])


@on_both_rigs
def test_a_step_is_a_classical_runge_kutta_step_with_exact_lag(rig: Parameters) -> None:
    """Against SciPy's solution with lagging flows: flows are exact, half the step leaves about a sixteenth of the error."""
    rng, span, state = np.random.default_rng(2), 0.008, states(rig, 2, 5)
    flows, commanded, pushes = rng.normal(0, 1, (4, 2)), rng.normal(0, 2, (4, 2)), rng.normal(0, 25, (4, 2))
    found = [stepped(rig, state, flows, commanded, pushes, span / count, count) for count in (4, 8, 16)]
    for lane in range(2):

        def slope(time: float, both: Array, lane: int = lane) -> Array:
            lag = (commanded[:, lane] - both[8:]) / rig.valves.time_constant
            return np.concatenate([second_rates(both[:8], both[8:], *np.split(pushes[:, lane], 2), rig), lag])

        begun = np.concatenate([state, flows])[:, lane]
        exact = solve_ivp(slope, (0, span), begun, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        for one in found:
            np.testing.assert_allclose(one[8:, lane], exact[8:], rtol=0, atol=1e-9)
        errors = [np.abs(one[:8, lane] - exact[:8]) for one in found]
        shrunk = np.linalg.norm(errors[:-1], axis=1) / np.linalg.norm(errors[1:], axis=1)
        assert np.all((shrunk > 15) & (shrunk < 17))
        assert np.all(errors[-1] < [1e-10, 1e-10, 2e-8, 2e-8, 1e-7, 1e-7, 1e-7, 1e-7])


@on_both_rigs
def test_end_effector_and_pneumatic_stiffness(rig: Parameters) -> None:
    """Of the linkage made of points; and how the force falls along the stroke where shut chambers of (9) are squeezed."""
    state, found = states(rig, 30, 7), np.empty((OUTPUTS, 30))
    for lane in range(30):
        horizon.outputs(state * UNITS[:, None], Rig(parameter_column(rig)), found, lane)
        expected = seen_from_outside(state[:, lane], rig)
        np.testing.assert_allclose(found[:4, lane], expected[:4], rtol=0, atol=1e-12)
        np.testing.assert_allclose(found[4:, lane], expected[4:], rtol=1e-6)


def drawn(rig: Parameters, lanes: int, seed: int) -> HorizonInputs:
    """Random situations; motion and stiffnesses are some tolerances away."""
    rng, given = np.random.default_rng(seed), HorizonInputs(np.empty((HorizonInputs.size, lanes)))
    state = states(rig, lanes, seed) * UNITS[:, None]
    given.joints.rows[:], given.pressure[:], given.flow[:] = state[:4], state[4:], FLOW * rng.normal(0, 1, (FLOWS, lanes))
    given.force[:], given.unseen[:] = rng.normal(0, 20, (2, lanes)), rng.normal(0, 20, (2 * NODES, lanes))
    given.motion[:] = rng.normal(0, 0.3, (4 * NODES, lanes))
    given.stiffness[:] = rng.normal(3000, 900, (2 * NODES, lanes))
    return given


def written_out(rig: Parameters, given: HorizonInputs, plan: Array, weight: Array) -> Array:
    """The residuals (10 NODES, N) as the module's documentation states them; ``plan`` (SIZE, N) in FLOW."""
    now = np.concatenate([given.joints.rows, given.pressure / PRESSURE, given.flow / FLOW])
    before, found = now[8:], []
    for k, time in enumerate(STEPS):
        commanded = plan[FLOWS * k : FLOWS * (k + 1)]
        pushes = np.concatenate([given.force, given.unseen[2 * k : 2 * k + 2]])
        now = stepped(rig, now[:8], now[8:], commanded, pushes, time)
        seen = np.stack([seen_from_outside(lane, rig) for lane in now[:8].T], axis=1)
        asked = np.concatenate([given.motion[4 * k : 4 * k + 4], given.stiffness[2 * k : 2 * k + 2]])
        sizes = np.repeat([TOLERANCES[name] for name in ("position", "speed", "stiffness")], 2)
        found += [weight[k] * (seen - asked) / sizes[:, None], FLOW * (commanded - before) / TOLERANCES["flow"]]
        before = commanded
    return np.concatenate(found)


def programmes(rig: Parameters, given: HorizonInputs, plan: Array, weight: Array) -> tuple[Array, Array]:
    """Squared slopes (HALF, N) and slopes (SIZE, N), by flows in FLOW; ``plan`` in FLOW."""
    lanes = plan.shape[1]
    h, g = np.empty((HALF, lanes)), np.empty((SIZE, lanes))
    horizon.programme(FLOW * plan, given, parameter_columns(rig, lanes), about(rig, STEPS, weight), h, g, lanes)
    return FLOW**2 * h, FLOW * g


@on_both_rigs
def test_the_programme_is_that_of_errors_over_tolerances_weighed_by_time(rig: Parameters) -> None:
    """J'J and J'r of errors and of changes of the flows, node by node; J by central differences."""
    rng, size = np.random.default_rng(9), 1e-3
    given, plan, weight = drawn(rig, 2, 11), rng.normal(0, 0.5, (SIZE, 2)), rng.uniform(0.3, 2.0, NODES)
    h, g = programmes(rig, given, plan, weight)
    ways = size * np.eye(SIZE)[:, :, None]
    sides = [[written_out(rig, given, plan + sign * way, weight) for way in ways] for sign in (1, -1)]
    slopes, values = (np.array(sides[0]) - np.array(sides[1])) / (2 * size), written_out(rig, given, plan, weight)
    for lane in range(2):
        j, r = slopes[:, :, lane], values[:, lane]
        np.testing.assert_allclose(g[:, lane], j @ r, rtol=0, atol=2e-5 * np.abs(j @ r).max())
        np.testing.assert_allclose(h[:, lane], (j @ j.T)[np.tril_indices(SIZE)], rtol=0, atol=2e-5 * np.abs(j @ j.T).max())
