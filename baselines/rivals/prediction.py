"""What the nonlinear MPC expects of the rig: the control model over a horizon, in symbols, and what it minimises.

State: the pistons (5), the pressures by (6) with the dead volume, and the four mass flows, which follow the commanded ones with
the lag of the valves; the exact inverse of the valves' characteristic makes openings of them. Dry friction and what an observer
finds besides are forces that stay as they are, the user's force too. The classical Runge-Kutta method takes one step from
node to node of the horizon; the flows between are exact.

The sum of squares of the residuals is what the law minimises. At every node, weighed by the time that it stands for:
the end effector's distance from the motion, its speed relative to it, and the error of the pneumatic stiffness (9); between
nodes the changes of the commanded flows. Each is divided by its tolerance.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.valve_inverse import CLEARANCE
from birthsim_env.physics import control_model, geometry, mechanics
from birthsim_env.physics.rig.parameters import Cylinder, Parameters

PRESSURE, FLOW = 1e5, 1e-3
"""Pa and kg/s: units of pressures and flows inside the residuals' arguments, so that all are of like size."""

LAST = 3.0
"""Weight of the last node, which stands for the time beyond the horizon; assumed."""

NODES_WEIGH = 0.01
"""s: a node that stands for so much time has the weight 1."""

STATE, FLOWS = 8, 4
"""Rows: y1, y2 (m), v1, v2 (m/s), pressures of P1, N1, P2, N2 (in PRESSURE), and the flows into these (in FLOW)."""


def symbols() -> Any:
    """CasADi. Raises ``ValueError`` where it is not installed."""
    try:
        import casadi
    except ModuleNotFoundError as error:
        raise ValueError("nonlinear-mpc needs CasADi, which is missing; allowed: after pip install 'birthsim[mpc]'") from error
    return casadi


def plain(helper: Any) -> Any:
    """The Python function of a kernel's helper, which takes symbols as well as numbers."""
    return helper.py_func


class ControlModel:
    """The rates of pistons and pressures of a rig in CasADi's symbols, from the same formulas as the kernels."""

    def __init__(self, rig: Parameters) -> None:
        self.rig, self.casadi = rig, symbols()

    def pose(self, y1: Any, y2: Any) -> tuple[Any, ...]:
        """r4, r2, w, S^2, kappa, sin(theta1), cos(theta1) as ``geometry.pose`` gives them."""
        g = self.rig.geometry
        product, sine, cosine = 2 * g.d3 * g.d6, np.sin(g.gamma3), np.cos(g.gamma3)
        r4, r2 = y1 + g.k1, y2 + g.k2
        w = r4 * r4 - (g.d3**2 + g.d6**2)
        s2 = plain(geometry.s_squared)(w, product)
        root = self.casadi.sqrt(s2)
        kappa = plain(geometry.amplification)(r2, r4, 1 / root)
        angles = (plain(geometry.sin_theta1), plain(geometry.cos_theta1))
        return r4, r2, w, s2, kappa, *(angle(w, root, 1 / product, sine, cosine) for angle in angles)

    def lengths(self, cylinder: Cylinder, y: Any) -> tuple[Any, Any]:
        """Lp and Ln, m, of a piston that an end stop keeps from leaving its stroke: nothing else in the model does."""
        half = cylinder.stroke / 2
        return self.casadi.fmax(half + y, CLEARANCE), self.casadi.fmax(half - y, CLEARANCE)

    def rates(self, state: Any, flows: Any, force: Any, disturbance_force: Any) -> Any:
        """d(state)/dt; ``force`` (2,), N, is the user's, ``disturbance_force`` (2,), N, acts along the pistons besides."""
        air, mass, gravity = self.rig.air, self.rig.mechanics.mass, self.rig.mechanics.gravity
        y, v = (state[0], state[1]), (state[2], state[3])
        r4, r2, w, s2, kappa, sine, cosine = self.pose(*y)
        users = (
            plain(mechanics.user_force1)(force[0], force[1], kappa, sine, cosine),
            plain(mechanics.user_force2)(force[0], force[1], sine, cosine),
        )
        index, gas_t = air.polytropic_index, air.gas_constant * air.temperature
        loads, pressure_rates = [], []
        for i, cylinder in enumerate((self.rig.cylinder1, self.rig.cylinder2)):
            pp, pn = PRESSURE * state[4 + 2 * i], PRESSURE * state[5 + 2 * i]
            qp, qn, ap, an = FLOW * flows[2 * i], FLOW * flows[2 * i + 1], cylinder.area_p, cylinder.area_n
            held = plain(mechanics.piston_force)(pp, pn, ap, an, air.atmospheric_pressure)
            loads.append(held - cylinder.viscous_friction * v[i] + users[i] + disturbance_force[i])
            dead, lengths = self.rig.chambers.dead_volume, self.lengths(cylinder, y[i])
            rate_p = plain(control_model.polytropic_rate_p)(pp, qp, v[i], ap, lengths[0] + dead / ap, index, gas_t)
            rate_n = plain(control_model.polytropic_rate_n)(pn, qn, v[i], an, lengths[1] + dead / an, index, gas_t)
            pressure_rates += [rate_p / PRESSURE, rate_n / PRESSURE]
        a1 = plain(mechanics.acceleration1)(loads[0], *v, r2, r4, w, s2, kappa, sine, 1 / mass, gravity)
        a2 = plain(mechanics.acceleration2)(loads[1], v[0], r2, r4, s2, cosine, 1 / mass, gravity)
        return self.casadi.vertcat(*v, a1, a2, *pressure_rates)

    def step(self, state: Any, flows: Any, commanded: Any, force: Any, disturbance_force: Any, time: float) -> tuple[Any, Any]:
        """State and flows after ``time``, s, in which the flows follow the ``commanded`` ones."""
        kept = np.exp(-time / 2 / self.rig.valves.time_constant)
        middle, end = commanded + kept * (flows - commanded), commanded + kept**2 * (flows - commanded)
        k1 = self.rates(state, flows, force, disturbance_force)
        k2 = self.rates(state + time / 2 * k1, middle, force, disturbance_force)
        k3 = self.rates(state + time / 2 * k2, middle, force, disturbance_force)
        k4 = self.rates(state + time * k3, end, force, disturbance_force)
        return state + time / 6 * (k1 + 2 * k2 + 2 * k3 + k4), end

    def end_effector(self, state: Any) -> tuple[Any, Any, Any, Any]:
        """x, y, m, and vx, vy, m/s."""
        _, r2, _, _, kappa, sine, cosine = self.pose(state[0], state[1])
        v1, v2 = state[2], state[3]
        return r2 * sine, -r2 * cosine, v2 * sine - kappa * v1 * cosine, -kappa * v1 * sine - v2 * cosine

    def pneumatic_stiffness(self, state: Any) -> list[Any]:
        """(9) of both cylinders, N/m."""
        stiffness = []
        for i, cylinder in enumerate((self.rig.cylinder1, self.rig.cylinder2)):
            pp, pn, lengths = PRESSURE * state[4 + 2 * i], PRESSURE * state[5 + 2 * i], self.lengths(cylinder, state[i])
            areas, index = (cylinder.area_p, cylinder.area_n), self.rig.air.polytropic_index
            stiffness.append(plain(control_model.pneumatic_stiffness)(pp, pn, *areas, *lengths, index))
        return stiffness


def residuals(rig: Parameters, steps: Sequence[float], tolerances: Mapping[str, float]) -> Any:
    """CasADi function (commanded, given) -> (residuals (R,), their Jacobian (R, 4 M)) over the M ``steps``, s, of a horizon.

    ``commanded`` (4 M,): the flows of every step, in FLOW. ``given``: state (8,), flows (4,), user force (2,), N, and node by
    node forces unseen (2 M,), N, the motion's x, y, vx, vy (4 M,), SI, and the pneumatic stiffnesses asked for (2 M,), N/m.
    ``tolerances``: position, m, speed, m/s, stiffness, N/m, and flow, kg/s.
    """
    casadi = symbols()
    model, count = ControlModel(rig), len(steps)
    symbol = casadi.SX.sym
    start, flowing, force, disturbance_force = symbol("x", STATE), symbol("q", FLOWS), symbol("f", 2), symbol("d", 2, count)
    motion, asked, commanded = symbol("r", 4, count), symbol("K", 2, count), symbol("u", FLOWS, count)
    state, flows, before, found = start, flowing, flowing, []
    for k, time in enumerate(steps):
        state, flows = model.step(state, flows, commanded[:, k], force, disturbance_force[:, k], time)
        weight = np.sqrt(time / NODES_WEIGH * (LAST if k == count - 1 else 1.0))
        x, y, vx, vy = model.end_effector(state)
        found += [weight / tolerances["position"] * (x - motion[0, k]), weight / tolerances["position"] * (y - motion[1, k])]
        found += [weight / tolerances["speed"] * (vx - motion[2, k]), weight / tolerances["speed"] * (vy - motion[3, k])]
        for i, stiffness in enumerate(model.pneumatic_stiffness(state)):
            found.append(weight / tolerances["stiffness"] * (stiffness - asked[i, k]))
        found.append(FLOW / tolerances["flow"] * (commanded[:, k] - before))
        before = commanded[:, k]
    stacked, inputs = casadi.vertcat(*found), casadi.vec(commanded)
    given = casadi.vertcat(start, flowing, force, casadi.vec(disturbance_force), casadi.vec(motion), casadi.vec(asked))
    slopes = casadi.densify(casadi.jacobian(stacked, inputs))
    names = (["commanded", "given"], ["residuals", "slopes"])
    return casadi.Function("residuals", [inputs, given], [stacked, slopes], *names)
