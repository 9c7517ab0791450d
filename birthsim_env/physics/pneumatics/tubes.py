"""A tube between a valve and a chamber: the pressure at either end, and the air that moves between them.

The air at the valve's end is a quarter of the tube's. It keeps the temperature of the walls, since a bore of 4 mm has 1000 m2
of wall for each m3 of air; the rest of the tube counts to the chamber's dead volume. Between both, a plug of air is pushed by
the pressures and held back by friction: resistance, capacitance and inertance of one control volume.

    V dP/dt = r T (q supplied - q exhausted - q)
    dq/dt = A/L [min(Pu - Pd, (1 - b) Pu) - (1 - b) q |q| / ((C rho0)^2 (T0/Tu) Pu (1 + X))] - 32 mu r T/(d^2 Pu) q
    X = max(0, (Pd/Pu - b)/(1 - b))

where u is the end with the higher pressure. But for the last term, the laminar friction of Hagen and Poiseuille, which matters
for small flows, a steady flow is exactly that of ISO 6358, q = C rho0 Pu sqrt(T0/Tu) sqrt(1 - X^2), with the conductance and
the critical ratio of a tube (Gidlund, in Beater, Pneumatic Drives, Springer 2007), in SI units:

    C = 0.029 d^2 / sqrt(L/d^1.25 + 510),   b = 474 C/d^2

The delay L/c of Richer and Hurmuzlu (2000) is that of the plug's inertia. An orifice in place of the plug, without inertia,
would follow within 0.1 ms, and an explicit step could not. ``docs/plant_options.md`` has what was measured.
"""

import math

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.pneumatics import air, valves
from birthsim_env.physics.rig.pneumatic import IN_CHAMBER
from birthsim_env.physics.step import STEP

AT_VALVE = 1.0 - IN_CHAMBER
"""Part of the tube's air that is at the valve's end. On tubes of 1 to 8 m with a dead end 0.2 to 0.25 errs least."""

VISCOSITY = 1.81e-5
"""mu of air at 20 C, Pa s."""

GAIN, INERTANCE, VISCOUS, RESISTANCE, CRITICAL = range(5)
CONSTANTS = 5
"""Rows of a tube's constants: r T/V at the valve's end, Pa/kg; A/L, m; 32 mu r T/d^2, Pa/s; (1 - b)/(C rho0)^2; b."""


@helper
def conductance(length: float, diameter: float) -> float:
    """C of a tube, m3/(s Pa)."""
    return 0.029 * diameter * diameter / math.sqrt(length / (diameter * math.sqrt(math.sqrt(diameter))) + 510.0)


@helper
def critical_ratio(sonic: float, diameter: float) -> float:
    """b of a tube with a conductance ``sonic``."""
    return 474.0 * sonic / (diameter * diameter)


@helper
def flow_rate(
    pressure: float,
    beyond: float,
    flow: float,
    coldness: float,
    inertance: float,
    viscous: float,
    resistance: float,
    critical: float,
) -> float:
    """dq/dt of the ``flow`` from an end with ``pressure`` to the one ``beyond``, kg/s2.

    ``coldness`` is T0/T of the air at the end with the higher pressure.
    """
    forward = pressure > beyond
    upper, lower = pressure if forward else beyond, beyond if forward else pressure
    open_ = 1.0 - critical
    ratio = max(lower / upper - critical, 0.0) / open_
    push = min(upper - lower, open_ * upper)
    drag = resistance * flow * abs(flow) / (upper * coldness * (1.0 + ratio))
    return inertance * ((push if forward else -push) - drag) - viscous * flow / upper


@helper
def at_valve(p: Array, i: int, end: float, pressure: float, temperature: float) -> tuple[float, float]:
    """Pressure and coldness T0/T of the air that a valve meets: at the ``end`` of its tube, if it has one, or a chamber's."""
    has_tube = p[at.TUBE_LENGTH, i] > 0.0
    return end if has_tube else pressure, p[at.COLDNESS, i] if has_tube else p[at.T0, i] / temperature


@helper
def widest(p: Array, i: int) -> float:
    """The largest conductance that an edge of the valves can have, m3/(s Pa)."""
    most, full, leakage = 0.0, p[at.CONDUCTANCE, i], p[at.LEAKAGE, i]
    for k in range(4):
        supply = valves.edge_conductance(1.0, air.supply_edge(p, i, k), full, leakage)
        exhaust = valves.edge_conductance(1.0, air.exhaust_edge(p, i, k), full, leakage)
        most = max(most, max(supply, exhaust))
    return most


@helper
def fill_constants(p: Array, constants: Array, n: int) -> None:
    """Fill ``constants`` (CONSTANTS, n) of the tubes of ``n`` lanes; those of a lane without are of no use.

    A tube's end holds at least as much air as a port and fittings do, so that a step of the integrator follows the valve.
    """
    for i in range(n):
        length, diameter = max(p[at.TUBE_LENGTH, i], STEP.shortest_tube), p[at.TUBE_DIAMETER, i]
        area = 0.25 * math.pi * diameter * diameter
        gas_t, rho0 = p[at.GAS, i] * p[at.TEMPERATURE, i], p[at.RHO0, i]
        quickest = gas_t * rho0 * math.sqrt(p[at.COLDNESS, i]) * widest(p, i) * p[at.LAMINAR, i]
        volume = max(AT_VALVE * area * p[at.TUBE_LENGTH, i], quickest / STEP.fastest_tube)
        sonic = conductance(p[at.TUBE_LENGTH, i], diameter)
        critical = critical_ratio(sonic, diameter)
        constants[GAIN, i], constants[INERTANCE, i] = gas_t / volume, area / length
        constants[VISCOUS, i] = 32.0 * VISCOSITY * gas_t / (diameter * diameter)
        constants[RESISTANCE, i], constants[CRITICAL, i] = (1.0 - critical) / (sonic * rho0 * (sonic * rho0)), critical
