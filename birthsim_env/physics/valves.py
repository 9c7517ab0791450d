"""Servovalves: ISO 6358 orifices, the two orifices of a chamber, and the inverse of their characteristic.

    q = Cx rho0 Pu sqrt(T0/Tu) psi(Pd/Pu),  psi = 1 below b, sqrt(1 - ((x-b)/(1-b))^2) above, linear to zero above 0.99

Every chamber has an orifice to the supply, C max(s, 0) + Cl, and one to the atmosphere, C max(-s, 0) + Cl.
"""

from __future__ import annotations

import math

from birthsim_env.physics.compilation import helper

LINEAR_RATIO = 0.99
"""Pressure ratio above which the flow falls linearly to zero, as ISO 6358-1:2013 does in the laminar range; without it the
slope at equal pressures would be infinite."""


@helper
def flow_function(ratio: float, critical: float) -> float:
    """psi(Pd/Pu) of ISO 6358, in [0, 1]."""
    scaled = (max(ratio, critical) - critical) / (1.0 - critical)
    edge = (LINEAR_RATIO - critical) / (1.0 - critical)
    subsonic = math.sqrt(max(1.0 - scaled * scaled, 0.0))
    laminar = math.sqrt(1.0 - edge * edge) * (1.0 - ratio) / (1.0 - LINEAR_RATIO)
    return laminar if ratio > LINEAR_RATIO else subsonic


@helper
def density_factor(temperature: float, rho0: float, t0: float) -> float:
    """rho0 sqrt(T0/T), kg/m3: what a unit of conductance and upstream pressure carries from air at ``temperature``."""
    return rho0 * math.sqrt(t0 / temperature)


@helper
def orifice_flow(
    conductance: float, p_from: float, factor_from: float, p_to: float, factor_to: float, critical: float
) -> float:
    """Mass flow from one side to the other, kg/s; negative where the far side has the higher pressure (roles exchanged)."""
    upstream = max(p_from, p_to)
    size = conductance * upstream * flow_function(min(p_from, p_to) / upstream, critical)
    return size * factor_from if p_from > p_to else -size * factor_to


@helper
def supply_conductance(opening: float, conductance: float, leakage: float) -> float:
    """Conductance of the supply orifice at a spool opening in [-1, 1], m3/(s Pa)."""
    return conductance * max(opening, 0.0) + leakage


@helper
def exhaust_conductance(opening: float, conductance: float, leakage: float) -> float:
    """Conductance of the exhaust orifice at a spool opening in [-1, 1], m3/(s Pa)."""
    return conductance * max(-opening, 0.0) + leakage


@helper
def opening_for(wanted: float, up: float, down: float, conductance: float) -> float:
    """Opening in [-1, 1] for a flow ``wanted`` (kg/s) beyond leakage, of which an opening of 1 gives conductance x ``up``.

    An opening of -1 gives -conductance x ``down``. Where the side that is needed has no driving pressure it stays shut.
    """
    driving = up if wanted > 0.0 else down
    opened = wanted / (conductance * max(driving, 1e-9))
    return max(-1.0, min(1.0, opened)) if driving > 0.0 else 0.0


@helper
def opening_for_flow(flow: float, fill: float, drain: float, conductance: float, leakage: float) -> float:
    """Opening in [-1, 1] at which a chamber's net mass flow is ``flow`` (kg/s): the exact inverse of the characteristic.

    ``fill`` and ``drain`` are the flows per unit of conductance through the supply and exhaust orifices at the present
    pressures. Saturates where the flow is too large to be had, and stays shut where opening would let it run the other way.
    """
    return opening_for(flow - leakage * (fill - drain), fill, drain, conductance)


@helper
def opening_for_active_flow(
    active: float,
    fill_p: float,
    drain_p: float,
    fill_n: float,
    drain_n: float,
    share_p: float,
    share_n: float,
    conductance: float,
    leakage: float,
) -> float:
    """Opening of ONE 5/3 valve (chamber N gets the opposite) at which share_p qp - share_n qn is ``active``, kg/s.

    With ``share = l / (2 L)`` of each chamber the weighted difference is qA of (8).
    """
    wanted = active - leakage * (share_p * (fill_p - drain_p) - share_n * (fill_n - drain_n))
    return opening_for(wanted, share_p * fill_p + share_n * drain_n, share_p * drain_p + share_n * fill_n, conductance)
