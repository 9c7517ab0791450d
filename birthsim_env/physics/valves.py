"""Servovalves: ISO 6358 orifices, the two orifices of a chamber, and the inverse of their characteristic.

    q = Cx rho0 Pu sqrt(T0/Tu) psi(Pd/Pu),  psi = 1 below b, sqrt(1 - ((x-b)/(1-b))^2) above, linear to zero above 0.99

Every chamber has an orifice to the supply, C max(s, 0) + Cl, and one to the atmosphere, C max(-s, 0) + Cl.
"""

import math

import numpy as np

from birthsim_env.physics.compiled.compilation import helper

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
    fraction_p: float,
    fraction_n: float,
    conductance: float,
    leakage: float,
) -> float:
    """Opening of ONE 5/3 valve (chamber N gets the opposite) at which fraction_p qp - fraction_n qn is ``active``, kg/s.

    With ``fraction = l / (2 L)`` of each chamber the weighted difference is qA of (8).
    """
    wanted = active - leakage * (fraction_p * (fill_p - drain_p) - fraction_n * (fill_n - drain_n))
    return opening_for(
        wanted, fraction_p * fill_p + fraction_n * drain_n, fraction_p * drain_p + fraction_n * fill_n, conductance
    )
