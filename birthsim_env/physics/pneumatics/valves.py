"""Servovalves: ISO 6358 orifices, the two orifices of a chamber, and the inverse of their characteristic.

    q = Cx rho0 Pu sqrt(T0/Tu) psi(Pd/Pu),  psi = 1 below b, sqrt(1 - ((x-b)/(1-b))^2) above, linear to zero above 0.99

Every chamber has an orifice to the supply and one to the atmosphere. Each is a metering edge of its valve's spool, C g + Cl,
with g of ``characteristic``.
"""

import math
from typing import NamedTuple

import numpy as np

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.pneumatics.characteristic import Edge, common_opening, opened_part, opening_of

LINEAR_RATIO = 0.99
"""Pressure ratio above which the flow falls linearly to zero, as ISO 6358-1:2013 does in the laminar range; without it the
slope at equal pressures would be infinite."""


def laminar_slope(critical: float) -> float:
    """-dpsi/dx above ``LINEAR_RATIO``; ``critical`` may be an array."""
    edge = (LINEAR_RATIO - critical) / (1.0 - critical)
    slope: float = np.sqrt(1.0 - edge * edge) / (1.0 - LINEAR_RATIO)
    return slope


@helper
def flow_square(ratio: float, critical: float, knee: float, slope: float) -> float:
    """psi(Pd/Pu)^2, see ``flow_function``."""
    scaled, laminar = (max(ratio, critical) - critical) * knee, slope * max(1.0 - ratio, 0.0)
    return laminar * laminar if ratio > LINEAR_RATIO else max(1.0 - scaled * scaled, 0.0)


@helper
def flow_function(ratio: float, critical: float, knee: float, slope: float) -> float:
    """psi(Pd/Pu) of ISO 6358, in [0, 1]; ``knee`` is 1/(1 - critical), ``slope`` that of ``laminar_slope``."""
    return math.sqrt(flow_square(ratio, critical, knee, slope))


@helper
def driving_flow(
    p_from: float,
    inverse_from: float,
    coldness_from: float,
    p_to: float,
    inverse_to: float,
    coldness_to: float,
    rho0: float,
    critical: float,
    knee: float,
    slope: float,
) -> float:
    """Mass flow per unit of conductance from one side to the other, Pa kg/m3; negative where the far side has the higher
    pressure (roles exchanged).

    ``inverse_from`` and ``inverse_to`` are 1/P, which the caller has at hand; the coldness of air is T0/T.
    """
    forward = p_from > p_to
    ratio = p_to * inverse_from if forward else p_from * inverse_to
    coldness = coldness_from if forward else coldness_to
    size = rho0 * max(p_from, p_to) * math.sqrt(coldness * flow_square(ratio, critical, knee, slope))
    return size if forward else -size


class Valve(NamedTuple):
    """A valve as whoever inverts its characteristic knows it: its edges, conductance and leakage, m3/(s Pa), and the part of
    the conductance over which the overlap is crossed."""

    supply: Edge
    exhaust: Edge
    conductance: float
    leakage: float
    crossing: float


@helper
def edge_conductance(opening: float, edge: Edge, conductance: float, leakage: float) -> float:
    """Conductance of the orifice behind an edge at a spool opening in [-1, 1], m3/(s Pa); that of the exhaust opens at -s."""
    return conductance * opened_part(opening, edge) + leakage


@helper
def opening_for_flow(flow: float, fill: float, drain: float, valve: Valve) -> float:
    """Opening in [-1, 1] at which a chamber's net mass flow is ``flow`` (kg/s): the inverse of the characteristic.

    ``fill`` and ``drain`` are the flows per unit of conductance through the supply and exhaust orifices at the present
    pressures. It is exact but for flows with which the overlap is crossed. It saturates where the flow is too large to be had,
    and the valve stays shut where opening would let it run the other way.
    """
    wanted = flow - valve.leakage * (fill - drain)
    driving, edge = (fill, valve.supply) if wanted > 0.0 else (drain, valve.exhaust)
    part = abs(wanted) / (valve.conductance * max(driving, 1e-9))
    return math.copysign(opening_of(part, edge, valve.crossing), wanted) if driving > 0.0 else 0.0


@helper
def opening_for_active_flow(
    active: float,
    fill_p: float,
    drain_p: float,
    fill_n: float,
    drain_n: float,
    fraction_p: float,
    fraction_n: float,
    valve_p: Valve,
    valve_n: Valve,
) -> float:
    """Opening of ONE 5/3 valve (chamber N gets the opposite) at which fraction_p qp - fraction_n qn is ``active``, kg/s.

    With ``fraction = l / (2 L)`` of each chamber the weighted difference is qA of (8). Opening the edge of chamber P to the
    supply opens that of chamber N to the exhaust, which have the numbers of ``valve_p`` and ``valve_n``.
    """
    wanted = active - valve_p.leakage * (fraction_p * (fill_p - drain_p) - fraction_n * (fill_n - drain_n))
    opens = wanted > 0.0
    driving_p, edge_p = (fraction_p * fill_p, valve_p.supply) if opens else (fraction_p * drain_p, valve_p.exhaust)
    driving_n, edge_n = (fraction_n * drain_n, valve_n.exhaust) if opens else (fraction_n * fill_n, valve_n.supply)
    driving = driving_p + driving_n
    most = max(driving, 1e-9)
    part = abs(wanted) / (valve_p.conductance * most)
    opened = common_opening(part, driving_p / most, edge_p, edge_n, valve_p.crossing)
    return math.copysign(opened, wanted) if driving > 0.0 else 0.0
