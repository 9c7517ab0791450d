"""From wanted rates of force and pneumatic stiffness to spool openings: (10), the inverse A-T transform, the inverse valves."""

from __future__ import annotations

import numpy as np

from birthsim_env.physics import control_model, valves
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array


@helper
def driving_flows(pressure: float, p: Array) -> tuple[float, float]:
    """Flows per unit of conductance from the supply into a chamber, and from it to the atmosphere, Pa kg/m3, as believed.

    No temperature is measured: all air counts as ambient. ``p`` (PARAMETERS,).
    """
    inverse, air, rho0 = 1.0 / pressure, p[at.COLDNESS], p[at.RHO0]
    critical, knee, slope = p[at.CRITICAL], p[at.KNEE], p[at.LAMINAR]
    return (
        valves.driving_flow(p[at.SUPPLY], p[at.INVERSE_SUPPLY], air, pressure, inverse, air, rho0, critical, knee, slope),
        valves.driving_flow(
            pressure, inverse, air, p[at.ATMOSPHERE], p[at.INVERSE_ATMOSPHERE], air, rho0, critical, knee, slope
        ),
    )


@helper
def two_valve_openings(
    u: Array, i: int, row: int, rate: float, stiffness_rate: float, pp: float, pn: float, ap: float, an: float,
    length_p: float, length_n: float, v: float, p: Array,
) -> None:  # fmt: skip
    """Writes the openings of one cylinder's two valves, rows ``row`` and ``row + 1``, for the wanted dF/dt and dK/dt.

    Where a valve saturates, both rates fall short: neither has priority (the paper's law).
    """
    index, gas_t = p[at.INDEX], p[at.GAS] * p[at.TEMPERATURE]
    force = pp * ap - pn * an
    stiffness = control_model.pneumatic_stiffness(pp, pn, ap, an, length_p, length_n, index)
    active = control_model.active_flow_for(rate, stiffness, v, length_p + length_n, index, gas_t)
    pressurization = control_model.pressurization_flow_for(
        stiffness_rate, force, stiffness, v, active, length_p, length_n, index, gas_t
    )
    flow_p = control_model.chamber_flow_p(active, pressurization, length_p, length_n)
    flow_n = control_model.chamber_flow_n(active, pressurization, length_p, length_n)
    fill_p, drain_p = driving_flows(pp, p)
    fill_n, drain_n = driving_flows(pn, p)
    u[row, i] = valves.opening_for_flow(flow_p, fill_p, drain_p, p[at.CONDUCTANCE], p[at.LEAKAGE])
    u[row + 1, i] = valves.opening_for_flow(flow_n, fill_n, drain_n, p[at.CONDUCTANCE], p[at.LEAKAGE])


@helper
def one_valve_openings(
    u: Array, i: int, row: int, rate: float, pp: float, pn: float, ap: float, an: float, length_p: float, length_n: float,
    v: float, p: Array,
) -> None:  # fmt: skip
    """Writes the openings of one cylinder's single 5/3 valve for the wanted dF/dt: chamber N gets minus those of chamber P.

    The pneumatic stiffness is left to itself.
    """
    index, gas_t = p[at.INDEX], p[at.GAS] * p[at.TEMPERATURE]
    stroke = length_p + length_n
    stiffness = control_model.pneumatic_stiffness(pp, pn, ap, an, length_p, length_n, index)
    active = control_model.active_flow_for(rate, stiffness, v, stroke, index, gas_t)
    fill_p, drain_p = driving_flows(pp, p)
    fill_n, drain_n = driving_flows(pn, p)
    opened = valves.opening_for_active_flow(
        active, fill_p, drain_p, fill_n, drain_n, 0.5 * stroke / length_p, 0.5 * stroke / length_n, p[at.CONDUCTANCE],
        p[at.LEAKAGE],
    )  # fmt: skip
    u[row, i], u[row + 1, i] = opened, -opened


@helper
def force_first_openings(
    u: Array, i: int, row: int, rate: float, stiffness_rate: float, pp: float, pn: float, ap: float, an: float,
    length_p: float, length_n: float, v: float, p: Array,
) -> None:  # fmt: skip
    """As ``two_valve_openings``, but where a valve saturates the pneumatic stiffness gives way to the force.

    The pressurisation flow is moved to the nearest at which both chambers still get what the active flow asks of them;
    where none is, the active flow comes as near as both valves allow.
    """
    index, gas_t = p[at.INDEX], p[at.GAS] * p[at.TEMPERATURE]
    force = pp * ap - pn * an
    stiffness = control_model.pneumatic_stiffness(pp, pn, ap, an, length_p, length_n, index)
    active = control_model.active_flow_for(rate, stiffness, v, length_p + length_n, index, gas_t)
    pressurization = control_model.pressurization_flow_for(
        stiffness_rate, force, stiffness, v, active, length_p, length_n, index, gas_t
    )
    fill_p, drain_p = driving_flows(pp, p)
    fill_n, drain_n = driving_flows(pn, p)
    c, leak = p[at.CONDUCTANCE], p[at.LEAKAGE]
    to_p, to_n = (length_p + length_n) / length_p, (length_p + length_n) / length_n
    # Bounds of qT + qA and of qT - qA from what each chamber can get; a valve without driving pressure stays shut.
    shut_p, shut_n = leak * (fill_p - drain_p), leak * (fill_n - drain_n)
    most_p, least_p = to_p * (shut_p + c * max(fill_p, 0.0)), to_p * (shut_p - c * max(drain_p, 0.0))
    most_n, least_n = to_n * (shut_n + c * max(fill_n, 0.0)), to_n * (shut_n - c * max(drain_n, 0.0))
    low, high = max(least_p - active, least_n + active), min(most_p - active, most_n + active)
    middle = 0.5 * (low + high)
    pressurization = max(low, min(high, pressurization)) if low < high else middle
    flow_p = control_model.chamber_flow_p(active, pressurization, length_p, length_n)
    flow_n = control_model.chamber_flow_n(active, pressurization, length_p, length_n)
    u[row, i] = valves.opening_for_flow(flow_p, fill_p, drain_p, c, leak)
    u[row + 1, i] = valves.opening_for_flow(flow_n, fill_n, drain_n, c, leak)


@kernel
def _flow_ranges(pressures: Array, spools: Array, p: Array, least: Array, most: Array, present: Array) -> None:
    c, leak = p[at.CONDUCTANCE], p[at.LEAKAGE]
    for chamber in range(4):
        for i in range(pressures.shape[1]):
            fill, drain = driving_flows(pressures[chamber, i], p)
            shut, spool = leak * (fill - drain), spools[chamber, i]
            least[chamber, i], most[chamber, i] = shut - c * max(drain, 0.0), shut + c * max(fill, 0.0)
            present[chamber, i] = shut + c * (max(spool, 0.0) * fill - max(-spool, 0.0) * drain)


def flow_ranges(pressures: Array, spools: Array, lane_parameters: Array) -> tuple[Array, Array, Array]:
    """Least and largest mass flow that valves can send into chambers P1, N1, P2, N2, and that of ``spools``, kg/s, (4, N) each.

    ``pressures`` (4, N), Pa, ``spools`` (4, N) in [-1, 1], one rig's parameters (PARAMETERS,).
    """
    least, most, present = np.empty_like(pressures), np.empty_like(pressures), np.empty_like(pressures)
    _flow_ranges(pressures, spools, lane_parameters, least, most, present)
    return least, most, present


@kernel
def _openings_for_flows(flows: Array, pressures: Array, p: Array, openings: Array) -> None:
    for chamber in range(4):
        for i in range(pressures.shape[1]):
            fill, drain = driving_flows(pressures[chamber, i], p)
            openings[chamber, i] = valves.opening_for_flow(flows[chamber, i], fill, drain, p[at.CONDUCTANCE], p[at.LEAKAGE])


def openings_for_flows(flows: Array, pressures: Array, lane_parameters: Array) -> Array:
    """Openings in [-1, 1] at which chambers P1, N1, P2, N2 get ``flows``, kg/s, or come near; (4, N) each."""
    openings = np.empty_like(flows)
    _openings_for_flows(flows, pressures, lane_parameters, openings)
    return openings
