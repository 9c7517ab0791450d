"""A chamber of the plant: pressure, temperature and heat exchange (the paper's section V).

V = V0 + S L,   Q = h (2 S + pi D L)(Twall - T) + G12 (Tother - T)
dP/dt = [gamma r (Tin qin - T qout) - gamma P dV/dt + (gamma - 1) Q] / V
dT/dt = T [ (dP/dt)/P + (dV/dt)/V - (qin - qout) r T / (P V) ]

Both are computed from powers, so that one division by P V serves a chamber.
"""

from birthsim_env.physics.compiled.compilation import helper


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
def pressing_power(temperature_flow: float, expansion: float, heat: float, gas: float, gamma: float) -> float:
    """V dP/dt, W; ``expansion`` is the power P dV/dt, W."""
    return gamma * (gas * temperature_flow - expansion) + (gamma - 1.0) * heat


@helper
def warming_power(pressing: float, expansion: float, net_flow: float, gas: float, temperature: float) -> float:
    """(P V/T) dT/dt, W, from the ideal gas law; ``pressing`` is V dP/dt."""
    return pressing + expansion - net_flow * gas * temperature
