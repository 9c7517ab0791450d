"""What the nonlinear MPC expects of the rig: Newton, polytropic chambers and SciPy along the horizon; its residuals."""

import dataclasses
import subprocess
import sys
from typing import Any

import casadi
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from baselines.registry import make_controller
from baselines.rivals import prediction
from baselines.rivals.prediction import FLOW, FLOWS, PRESSURE, ControlModel, residuals
from baselines.rivals.predictive import STEPS, Buffered, NonlinearMPC
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import derived_law, rigid_body
from tests.oracles import linkage_by_points as by_points

TILTED = Parameters().replace(
    {
        "geometry.gamma3": 1.2, "geometry.d3": 0.42, "geometry.d6": 0.21, "geometry.k1": 0.45, "mechanics.mass": 4.2,
        "cylinder1.viscous_friction": 55.0, "cylinder2.rod_diameter": 0.012, "chambers.dead_volume": 1.7e-5,
        "air.temperature": 310.0, "air.polytropic_index": 1.3, "valves.time_constant": 0.006,
    }
)  # fmt: skip
RIGS = {"default": Parameters(), "tilted": TILTED}
TOLERANCES = {"position": 2e-4, "speed": 7e-3, "stiffness": 250.0, "flow": 3e-3}
HORIZON = (0.002, 0.003, 0.007, 0.012)
NODE, NODES = 10, len(HORIZON)
"""Residuals of a node: x, y, vx, vy, two stiffnesses and four changes of flows."""

on_both_rigs = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)


def numbers(value: Any) -> Array:
    """A CasADi matrix of one column, or a sequence of numbers."""
    return np.array(casadi.vertcat(*value) if isinstance(value, tuple | list) else value).ravel()


def states(rig: Parameters, count: int, seed: int, speed: float = 0.3, push: float = 40.0) -> Array:
    """Random states (8, N) as ``ControlModel`` has them, near balance."""
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
    model, rng, found, expected = ControlModel(rig), np.random.default_rng(1), [], []
    for state in states(rig, 40, 0).T:
        flows, force, disturbance_force = rng.normal(0, 2, 4), rng.normal(0, 30, 2), rng.normal(0, 20, 2)
        found.append(numbers(model.rates(*map(casadi.DM, (state, flows, force, disturbance_force)))))
        expected.append(second_rates(state, flows, force, disturbance_force, rig))
    size = np.abs(expected).max(axis=0)
    assert np.all(size > [0.1, 0.1, 5, 5, 5, 5, 5, 5])
    np.testing.assert_allclose(found / size, expected / size, rtol=0, atol=1e-9)


def stepped(model: ControlModel, state: Array, flows: Array, commanded: Array, pushes: Array, times: list[float]) -> Array:
    """State and flows (12,) after steps of these ``times``; ``pushes`` (4,): the user's force, then that disturbance_force."""
    now, flowing, held = casadi.DM(state), casadi.DM(flows), (casadi.DM(pushes[:2]), casadi.DM(pushes[2:]))
    for time in times:
        now, flowing = model.step(now, flowing, casadi.DM(commanded), *held, time)
    return np.concatenate([numbers(now), numbers(flowing)])


@on_both_rigs
def test_a_step_is_a_classical_runge_kutta_step_with_exact_lag(rig: Parameters) -> None:
    """Against SciPy's solution of the second model, in which the flows follow by a first-order lag.

    The flows are exact; half the step leaves about a sixteenth of the error: below 0.1 nm and 0.01 Pa with steps of 0.5 ms.
    """
    model, rng, span = ControlModel(rig), np.random.default_rng(2), 0.008
    for state in states(rig, 2, 5).T:
        flows, commanded, pushes = rng.normal(0, 1, 4), rng.normal(0, 2, 4), rng.normal(0, 25, 4)

        def slope(time: float, both: Array, commanded: Array = commanded, pushes: Array = pushes) -> Array:
            lag = (commanded - both[8:]) / rig.valves.time_constant
            return np.concatenate([second_rates(both[:8], both[8:], pushes[:2], pushes[2:], rig), lag])

        exact = solve_ivp(slope, (0, span), np.concatenate([state, flows]), method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        errors = []
        for count in (4, 8, 16):
            found = stepped(model, state, flows, commanded, pushes, [span / count] * count)
            np.testing.assert_allclose(found[8:], exact[8:], rtol=0, atol=1e-9)
            errors.append(np.abs(found - exact)[:8])
        shrunk = np.linalg.norm(errors[:-1], axis=1) / np.linalg.norm(errors[1:], axis=1)
        assert np.all((shrunk > 15) & (shrunk < 17))
        assert np.all(errors[-1] < [1e-10, 1e-10, 2e-8, 2e-8, 1e-7, 1e-7, 1e-7, 1e-7])


@on_both_rigs
def test_end_effector_and_pneumatic_stiffness(rig: Parameters) -> None:
    """Of the linkage made of points; and how the force falls along the stroke where shut chambers, as (9) has them without
    dead volume, are squeezed."""
    model = ControlModel(rig)
    for state in states(rig, 30, 7).T:
        expected = seen_from_outside(state, rig)
        np.testing.assert_allclose(numbers(model.end_effector(casadi.DM(state))), expected[:4], rtol=0, atol=1e-12)
        np.testing.assert_allclose(numbers(model.pneumatic_stiffness(casadi.DM(state))), expected[4:], rtol=1e-6)


@dataclasses.dataclass
class Case:
    """Arguments of ``residuals``, drawn at random; forces, motion and stiffnesses node by node (M, rows)."""

    state: Array
    flows: Array
    force: Array
    disturbance_force: Array
    motion: Array
    asked: Array
    commanded: Array

    @property
    def given(self) -> Array:
        nodes = [part.ravel() for part in (self.disturbance_force, self.motion, self.asked)]
        return np.concatenate([self.state, self.flows, self.force, *nodes])


def drawn(rig: Parameters, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    return Case(
        states(rig, 1, seed)[:, 0],
        rng.normal(0, 1, 4),
        rng.normal(0, 20, 2),
        rng.normal(0, 20, (NODES, 2)),
        rng.normal(0, 0.3, (NODES, 4)),
        rng.normal(3000, 900, (NODES, 2)),
        rng.normal(0, 1, (NODES, FLOWS)),
    )  # fmt: skip


def written_out(case: Case, rig: Parameters, last: float, unit: float) -> Array:
    """The residuals (10 M,) as the module's documentation states them."""
    model, state, flows, before, found = ControlModel(rig), case.state, case.flows, case.flows, []
    for k, time in enumerate(HORIZON):
        pushes = np.concatenate([case.force, case.disturbance_force[k]])
        state, flows = np.split(stepped(model, state, flows, case.commanded[k], pushes, [time]), [8])
        weight = np.sqrt((last if k == NODES - 1 else 1.0) * time / unit)
        away = seen_from_outside(state, rig) - np.concatenate([case.motion[k], case.asked[k]])
        sizes = np.repeat([TOLERANCES[name] for name in ("position", "speed", "stiffness")], 2)
        found += [weight * away / sizes, FLOW * (case.commanded[k] - before) / TOLERANCES["flow"]]
        before = case.commanded[k]
    return np.concatenate(found)


@on_both_rigs
def test_residuals_are_errors_over_tolerances_weighed_by_time(rig: Parameters, monkeypatch: pytest.MonkeyPatch) -> None:
    """Node by node: position, speed and stiffness against what is asked for there, times the root of the time that the node
    stands for; changes of the commanded flows, the first from what flows now, whatever time there is for them."""
    for last, unit in ((prediction.LAST, prediction.NODES_WEIGH), (5.0, 0.002)):
        monkeypatch.setattr(prediction, "LAST", last)
        monkeypatch.setattr(prediction, "NODES_WEIGH", unit)
        function = residuals(rig, HORIZON, TOLERANCES)
        for seed in range(3):
            case = drawn(rig, seed)
            found = numbers(function(case.commanded.ravel(), case.given)[0])
            np.testing.assert_allclose(found, written_out(case, rig, last, unit), rtol=1e-6, atol=1e-6)


def test_a_plan_that_keeps_the_balance_leaves_no_residual() -> None:
    """At rest on the target, chambers shut, stiffnesses as asked for: zero; also where what is unseen holds the user off."""
    for rig in RIGS.values():
        now = rigid_body.near_balance(rig, 3, 3, 0.0, 0.0)
        function, push = residuals(rig, HORIZON, TOLERANCES), np.array([12.0, -25.0])
        for lane, jacobian in enumerate(rigid_body.jacobians(now.piston, rig)):
            state = np.concatenate([now.piston[:, lane], np.zeros(2), now.pressures[:, lane] / PRESSURE])
            target = np.concatenate([rigid_body.pose_of(now.piston, rig).end_effector[:, lane], np.zeros(2)])
            for force in (np.zeros(2), push):
                disturbance_force, asked = np.tile(-jacobian.T @ force, (NODES, 1)), np.tile(now.stiffness[:, lane], (NODES, 1))
                case = Case(
                    state, np.zeros(4), force, disturbance_force, np.tile(target, (NODES, 1)), asked, np.zeros((NODES, 4))
                )
                found = numbers(function(case.commanded.ravel(), case.given)[0])
                np.testing.assert_allclose(found, 0, rtol=0, atol=1e-7)


def test_what_comes_later_changes_nothing_before() -> None:
    """A flow acts from its step on, and forces, motion and stiffness at their own node (a force from there on)."""
    rig, case = TILTED, drawn(TILTED, 4)
    function = residuals(rig, HORIZON, TOLERANCES)
    base = numbers(function(case.commanded.ravel(), case.given)[0]).reshape(NODES, NODE)
    stays = {"commanded": False, "disturbance_force": False, "motion": True, "asked": True}
    for name, only_there in stays.items():
        changed = dataclasses.replace(case, **{name: getattr(case, name).copy()})
        getattr(changed, name)[1] += 0.1
        found = numbers(function(changed.commanded.ravel(), changed.given)[0]).reshape(NODES, NODE)
        differs = (found != base).any(axis=1)
        assert differs.tolist() == [False, True, not only_there, not only_there], name


@on_both_rigs
def test_slopes_are_the_residuals_derivatives(rig: Parameters) -> None:
    """Central differences; CasADi's own matrix, and what ``Buffered`` reads and writes, which it does column by column."""
    function, step = residuals(rig, STEPS, TOLERANCES), 1e-4
    size = FLOWS * len(STEPS)
    buffered, rng = Buffered(function), np.random.default_rng(9)
    for state in states(rig, 3, 11).T:
        commanded = rng.normal(0, 0.5, size)
        pushes, targets = rng.normal(0, 10, 2 + 2 * len(STEPS)), rng.normal(0, 0.3, 4 * len(STEPS))
        given = np.concatenate([state, rng.normal(0, 1, 4), pushes, targets, np.full(2 * len(STEPS), 3000.0)])
        values, slopes = (np.array(part) for part in function(commanded, given))
        differences = np.empty_like(slopes)
        for column in range(size):
            shift = step * (np.arange(size) == column)
            ahead, behind = (numbers(function(commanded + s, given)[0]) for s in (shift, -shift))
            differences[:, column] = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(slopes, differences, rtol=0, atol=1e-6 * np.abs(slopes).max())
        buffered.inputs["commanded"][:], buffered.inputs["given"][:] = commanded, given
        buffered.call()
        assert np.array_equal(buffered.outputs["residuals"], values[:, 0])
        assert np.array_equal(buffered.outputs["slopes"].reshape(size, -1).T, slopes)


def test_without_casadi_its_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    for make in (NonlinearMPC, lambda: make_controller("nonlinear-mpc", Parameters()), lambda: ControlModel(Parameters())):
        with pytest.raises(ValueError, match=r"nonlinear-mpc needs CasADi, .*allowed: after pip install 'birthsim\[mpc\]'"):
            make()


def test_all_other_controllers_do_without_casadi() -> None:
    """In an interpreter that cannot import it."""
    code = (
        "import sys; sys.modules['casadi'] = None\n"
        "from baselines.registry import LISTED, make_controller\n"
        "from birthsim_env.physics.rig.parameters import Parameters\n"
        "for name in set(LISTED) - {'nonlinear-mpc'}: make_controller(name, Parameters())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
