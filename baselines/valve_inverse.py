"""From wanted rates of force and pneumatic stiffness to spool openings: (10), the inverse A-T transform, the inverse valves."""

from typing import NamedTuple

from birthsim_env.physics import control_model
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.pneumatics import valves
from birthsim_env.physics.pneumatics.characteristic import Edge, largest_part, opened_part

CLEARANCE = 0.002
"""m; assumed: no chamber counts as shorter. Near an end stop a sensor may place the piston outside its stroke, where (9) has no
meaning."""


@helper
def driving_flows(pressure: float, p: Rig) -> tuple[float, float]:
    """Flows per unit of conductance from the supply into a chamber, and from it to the atmosphere, Pa kg/m3, as believed.

    No temperature is measured: all air counts as ambient. ``p`` (PARAMETERS,).
    """
    inverse, air, rho0 = 1.0 / pressure, p.coldness, p.rho0
    critical, knee, slope = p.critical, p.knee, p.laminar
    return (
        valves.driving_flow(p.supply, p.inverse_supply, air, pressure, inverse, air, rho0, critical, knee, slope),
        valves.driving_flow(pressure, inverse, air, p.atmosphere, p.inverse_atmosphere, air, rho0, critical, knee, slope),
    )


@helper
def valve_of(chamber: int, p: Rig) -> valves.Valve:
    """The valve of ``chamber``, 0 to 3 of P1, N1, P2, N2, as believed."""
    r = p.rows
    supply = Edge(r[at.SUPPLY_OVERLAP_P1 + chamber], r[at.SUPPLY_SLOPE_P1 + chamber], r[at.SUPPLY_BEND_P1 + chamber])
    exhaust = Edge(r[at.EXHAUST_OVERLAP_P1 + chamber], r[at.EXHAUST_SLOPE_P1 + chamber], r[at.EXHAUST_BEND_P1 + chamber])
    return valves.Valve(supply, exhaust, p.conductance, p.leakage, p.crossing)


class CylinderAir(NamedTuple):
    """Pressures (Pa), areas (m2) and lengths (m) of the chambers of cylinder ``number``, 0 or 1, at an instant, and the speed
    of its piston (m/s)."""

    number: int
    pp: float
    pn: float
    ap: float
    an: float
    length_p: float
    length_n: float
    speed: float


@helper
def air_at(k: int, pp: float, pn: float, y: float, v: float, p: Rig) -> CylinderAir:
    """Cylinder ``k``, 0 or 1, of a rig with its piston at ``y``, m."""
    ap, an = (p.area_p1, p.area_n1) if k == 0 else (p.area_p2, p.area_n2)
    half = p.half_l1 if k == 0 else p.half_l2
    return CylinderAir(k, pp, pn, ap, an, max(half + y, CLEARANCE), max(half - y, CLEARANCE), v)


@helper
def stiffness_of(c: CylinderAir, p: Rig) -> float:
    """Pneumatic stiffness (9), N/m."""
    return control_model.pneumatic_stiffness(c.pp, c.pn, c.ap, c.an, c.length_p, c.length_n, p.index)


@helper
def _flows_for(rate: float, stiffness_rate: float, c: CylinderAir, p: Rig) -> tuple[float, float]:
    """Active and pressurisation flow (10) for the wanted dF/dt and dK/dt."""
    index, gas_t, stiffness = p.index, p.gas * p.temperature, stiffness_of(c, p)
    force = c.pp * c.ap - c.pn * c.an
    active = control_model.active_flow_for(rate, stiffness, c.speed, c.length_p + c.length_n, index, gas_t)
    return active, control_model.pressurization_flow_for(
        stiffness_rate, force, stiffness, c.speed, active, c.length_p, c.length_n, index, gas_t
    )


@helper
def two_valve_openings(rate: float, stiffness_rate: float, c: CylinderAir, p: Rig) -> tuple[float, float]:
    """Openings of one cylinder's two valves for the wanted dF/dt and dK/dt.

    Where a valve saturates, both rates fall short: neither has priority (the paper's law).
    """
    active, pressurization = _flows_for(rate, stiffness_rate, c, p)
    flow_p = control_model.chamber_flow_p(active, pressurization, c.length_p, c.length_n)
    flow_n = control_model.chamber_flow_n(active, pressurization, c.length_p, c.length_n)
    fill_p, drain_p = driving_flows(c.pp, p)
    fill_n, drain_n = driving_flows(c.pn, p)
    opening_p = valves.opening_for_flow(flow_p, fill_p, drain_p, valve_of(2 * c.number, p))
    return opening_p, valves.opening_for_flow(flow_n, fill_n, drain_n, valve_of(2 * c.number + 1, p))


@helper
def one_valve_openings(rate: float, c: CylinderAir, p: Rig) -> tuple[float, float]:
    """Openings of one cylinder's single 5/3 valve for the wanted dF/dt: chamber N gets minus that of chamber P.

    The pneumatic stiffness is left to itself.
    """
    stroke = c.length_p + c.length_n
    active = control_model.active_flow_for(rate, stiffness_of(c, p), c.speed, stroke, p.index, p.gas * p.temperature)
    fill_p, drain_p = driving_flows(c.pp, p)
    fill_n, drain_n = driving_flows(c.pn, p)
    opened = valves.opening_for_active_flow(
        active,
        fill_p,
        drain_p,
        fill_n,
        drain_n,
        0.5 * stroke / c.length_p,
        0.5 * stroke / c.length_n,
        valve_of(2 * c.number, p),
        valve_of(2 * c.number + 1, p),
    )
    return opened, -opened


@helper
def force_first_openings(rate: float, stiffness_rate: float, c: CylinderAir, p: Rig) -> tuple[float, float]:
    """As ``two_valve_openings``, but where a valve saturates the pneumatic stiffness gives way to the force.

    The pressurisation flow is moved to the nearest at which both chambers still get what the active flow asks of them;
    where none is, the active flow comes as near as both valves allow.
    """
    active, pressurization = _flows_for(rate, stiffness_rate, c, p)
    fill_p, drain_p = driving_flows(c.pp, p)
    fill_n, drain_n = driving_flows(c.pn, p)
    full, leak, valve_p, valve_n = p.conductance, p.leakage, valve_of(2 * c.number, p), valve_of(2 * c.number + 1, p)
    to_p, to_n = (c.length_p + c.length_n) / c.length_p, (c.length_p + c.length_n) / c.length_n
    # Bounds of qT + qA and of qT - qA from what each chamber can get; a valve without driving pressure stays shut.
    shut_p, shut_n = leak * (fill_p - drain_p), leak * (fill_n - drain_n)
    most_p = to_p * (shut_p + full * largest_part(valve_p.supply) * max(fill_p, 0.0))
    least_p = to_p * (shut_p - full * largest_part(valve_p.exhaust) * max(drain_p, 0.0))
    most_n = to_n * (shut_n + full * largest_part(valve_n.supply) * max(fill_n, 0.0))
    least_n = to_n * (shut_n - full * largest_part(valve_n.exhaust) * max(drain_n, 0.0))
    low, high = max(least_p - active, least_n + active), min(most_p - active, most_n + active)
    middle = 0.5 * (low + high)
    pressurization = max(low, min(high, pressurization)) if low < high else middle
    flow_p = control_model.chamber_flow_p(active, pressurization, c.length_p, c.length_n)
    flow_n = control_model.chamber_flow_n(active, pressurization, c.length_p, c.length_n)
    opening_p = valves.opening_for_flow(flow_p, fill_p, drain_p, valve_p)
    return opening_p, valves.opening_for_flow(flow_n, fill_n, drain_n, valve_n)


@helper
def pressure_openings(rate: float, wanted: float, wanted_rate: float, c4: float, c: CylinderAir, p: Rig) -> tuple[float, float]:
    """``force_first_openings`` for dF/dt = ``rate`` while the pneumatic stiffness tends to ``wanted`` at c4."""
    return force_first_openings(rate, wanted_rate - c4 * (stiffness_of(c, p) - wanted), c, p)


@helper
def flow_ranges(pressures: Array, spools: Array, p: Rig, least: Array, most: Array, present: Array) -> None:
    """Writes the least and the largest mass flow that valves can send into chambers P1, N1, P2, N2, and that of ``spools``,
    kg/s; ``pressures``, Pa, and ``spools`` in [-1, 1]; all (4, N)."""
    c, leak = p.conductance, p.leakage
    for chamber in range(4):
        supply, exhaust, _, _, _ = valve_of(chamber, p)
        for i in range(pressures.shape[1]):
            fill, drain = driving_flows(pressures[chamber, i], p)
            shut, spool = leak * (fill - drain), spools[chamber, i]
            least[chamber, i] = shut - c * largest_part(exhaust) * max(drain, 0.0)
            most[chamber, i] = shut + c * largest_part(supply) * max(fill, 0.0)
            present[chamber, i] = shut + c * (opened_part(spool, supply) * fill - opened_part(-spool, exhaust) * drain)


@helper
def openings_for_flows(flows: Array, pressures: Array, p: Rig, openings: Array) -> None:
    """Writes openings in [-1, 1] at which chambers P1, N1, P2, N2 get ``flows``, kg/s, or come near; (4, N) each."""
    for chamber in range(4):
        valve = valve_of(chamber, p)
        for i in range(pressures.shape[1]):
            fill, drain = driving_flows(pressures[chamber, i], p)
            openings[chamber, i] = valves.opening_for_flow(flows[chamber, i], fill, drain, valve)
