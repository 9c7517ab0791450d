"""The control model in the paper's state space (11)-(14): what the backstepping law is derived from.

State X, (8, N), in the order of (12): y2, v2, F2, K2, y1, v1, F1, K1; F is the pneumatic force Pp Sp - Pn Sn and K the
pneumatic stiffness (9). Input U, (4, N): qA2, qT2, qA1, qT1, the active and pressurisation mass flows of (8), kg/s.
"""

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.physics import control_model
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.compiled.records import Rows, row
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.seals import friction


class State(Rows):
    """X of (12)."""

    y2 = row("m", "position")
    v2 = row("m/s", "speed")
    f2 = row("N", "pneumatic force")
    k2 = row("N/m", "pneumatic stiffness")
    y1 = row("m", "position")
    v1 = row("m/s", "speed")
    f1 = row("N", "pneumatic force")
    k1 = row("N/m", "pneumatic stiffness")


class Flows(Rows):
    """U of (12)."""

    active2 = row("kg/s", "qA2")
    pressurization2 = row("kg/s", "qT2")
    active1 = row("kg/s", "qA1")
    pressurization1 = row("kg/s", "qT1")


@kernel
def _rates(x: State, u: Flows, p: Rig, neglected_fraction: float, rates: State, neglected: Array) -> None:
    gas_t, index = p.gas * p.temperature, p.index
    for i in range(x.rows.shape[1]):
        y2, v2, f2, k2, y1, v1, f1, k1 = x.y2[i], x.v2[i], x.f2[i], x.k2[i], x.y1[i], x.v1[i], x.f1[i], x.k1[i]
        r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        outside1 = p.atmosphere * (p.area_p1 - p.area_n1)
        outside2 = p.atmosphere * (p.area_p2 - p.area_n2)
        net1 = f1 - outside1 - friction.coulomb_force(v1, p.fc1, p.fv1, p.sign_slope)
        net2 = f2 - outside2 - friction.coulomb_force(v2, p.fc2, p.fv2, p.sign_slope)
        neglected[i] = mechanics.acceleration2(0.0, v1, r2, r4, s2, cosine, p.inverse_mass, p.gravity)
        lp1, ln1, lp2, ln2 = p.half_l1 + y1, p.half_l1 - y1, p.half_l2 + y2, p.half_l2 - y2
        rates.y2[i] = v2
        rates.v2[i] = net2 / p.mass + neglected_fraction * neglected[i]
        rates.f2[i] = control_model.force_rate(u.active2[i], k2, v2, lp2 + ln2, index, gas_t)
        rates.k2[i] = control_model.stiffness_rate(f2, k2, v2, u.active2[i], u.pressurization2[i], lp2, ln2, index, gas_t)
        rates.y1[i] = v1
        rates.v1[i] = mechanics.acceleration1(net1, v1, v2, r2, r4, w, s2, kappa, sine, p.inverse_mass, p.gravity)
        rates.f1[i] = control_model.force_rate(u.active1[i], k1, v1, lp1 + ln1, index, gas_t)
        rates.k1[i] = control_model.stiffness_rate(f1, k1, v1, u.active1[i], u.pressurization1[i], lp1, ln1, index, gas_t)


def _evaluate(state: ArrayLike, flows: ArrayLike, parameters: Parameters, fraction: float) -> tuple[Array, Array]:
    lanes = np.shape(state)[1] if np.ndim(state) == 2 else 1
    x, u = checked("state", state, (8, lanes), "SI"), checked("flows", flows, (4, lanes), "kg/s")
    rates, neglected = np.empty((8, lanes)), np.empty(lanes)
    _rates(State(x), Flows(u), Rig(parameter_column(parameters)), fraction, State(rates), neglected)
    return rates, neglected


def strict_feedback_rates(state: ArrayLike, flows: ArrayLike, parameters: Parameters, neglected: bool = False) -> Array:
    """dX/dt of (13), (8, N), for states (8, N) and virtual flows (4, N), SI units.

    Without ``neglected`` the system is in strict feedback form, as the law is derived; with it (14) is added to dv2/dt, as
    in (5). Raises ``ValueError`` for wrong shapes and numbers that are not finite.
    """
    return _evaluate(state, flows, parameters, float(neglected))[0]


def neglected_acceleration(state: ArrayLike, parameters: Parameters) -> Array:
    """The term (14), (N,), m/s2: weight and centrifugal acceleration along cylinder 2, for states (8, N).

    Raises ``ValueError`` for wrong shapes and numbers that are not finite.
    """
    return _evaluate(state, np.zeros((4, np.shape(state)[-1])), parameters, 0.0)[1]
