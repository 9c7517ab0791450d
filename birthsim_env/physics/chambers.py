"""A chamber of the plant: pressure, temperature and heat exchange (design section 3; the paper's section V).

V = V0 + S L,   Q = h (2 S + pi D L)(Twall - T) + G12 (Tother - T)
dP/dt = [gamma r (Tin qin - T qout) - gamma P dV/dt + (gamma - 1) Q] / V
dT/dt = T [ (dP/dt)/P + (dV/dt)/V - (qin - qout) r T / (P V) ]
"""

from __future__ import annotations

from birthsim_env.physics.compilation import helper


@helper
def heat_flow(
    temperature: float, other: float, wall: float, length: float, area: float, perimeter: float, h_wall: float, g12: float
) -> float:
    """Heat into the chamber's air from the wall and, through the piston, from the other chamber, W."""
    return h_wall * (2.0 * area + perimeter * length) * (wall - temperature) + g12 * (other - temperature)


@helper
def enthalpy_temperature_flow(supplied: float, exhausted: float, temperature: float, source: float) -> float:
    """Tin qin - T qout with every flow at its upstream temperature, K kg/s.

    ``supplied`` runs from the supply into the chamber, ``exhausted`` from the chamber to the atmosphere; either may be
    negative. Supply and atmosphere are at ``source``.
    """
    entering = max(supplied, 0.0) - min(exhausted, 0.0)
    leaving = max(exhausted, 0.0) - min(supplied, 0.0)
    return source * entering - temperature * leaving


@helper
def pressure_rate(
    pressure: float, volume: float, volume_rate: float, temperature_flow: float, heat: float, gas: float, gamma: float
) -> float:
    """dP/dt, Pa/s."""
    return (gamma * (gas * temperature_flow - pressure * volume_rate) + (gamma - 1.0) * heat) / volume


@helper
def temperature_rate(
    pressure: float, temperature: float, pressure_rate: float, volume: float, volume_rate: float, net_flow: float, gas: float
) -> float:
    """dT/dt, K/s, from the ideal gas law."""
    return temperature * (pressure_rate / pressure + volume_rate / volume - net_flow * gas * temperature / (pressure * volume))
