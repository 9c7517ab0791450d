"""The air in the four chambers of a lane: flows through their orifices, and the rates of pressures and temperatures.

State rows are those of ``lanes.STATE_NAMES``: P1, N1, P2, N2 in this order, of each its pressure and its temperature.
"""

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.stack import column
from birthsim_env.physics.pneumatics import chambers, valves
from birthsim_env.physics.pneumatics.characteristic import Edge


@helper
def driving_flows(p: Array, i: int, pressure: float, inverse: float, inside: float) -> tuple[float, float]:
    """Flows per unit of conductance from the supply into a chamber, and from it to the atmosphere, Pa kg/m3.

    ``inverse`` is 1/``pressure``, ``inside`` the coldness of the chamber's air.
    """
    outer, rho0, critical, knee, slope = p[at.COLDNESS, i], p[at.RHO0, i], p[at.CRITICAL, i], p[at.KNEE, i], p[at.LAMINAR, i]
    fill = valves.driving_flow(
        p[at.SUPPLY, i], p[at.INVERSE_SUPPLY, i], outer, pressure, inverse, inside, rho0, critical, knee, slope
    )
    drain = valves.driving_flow(
        pressure, inverse, inside, p[at.ATMOSPHERE, i], p[at.INVERSE_ATMOSPHERE, i], outer, rho0, critical, knee, slope
    )
    return fill, drain


@helper
def supply_edge(p: Array, i: int, k: int) -> Edge:
    """The edge through which the valve of chamber ``k`` fills it."""
    return Edge(p[at.SUPPLY_OVERLAP_P1 + k, i], p[at.SUPPLY_SLOPE_P1 + k, i], p[at.SUPPLY_BEND_P1 + k, i])


@helper
def exhaust_edge(p: Array, i: int, k: int) -> Edge:
    """The edge through which the valve of chamber ``k`` empties it."""
    return Edge(p[at.EXHAUST_OVERLAP_P1 + k, i], p[at.EXHAUST_SLOPE_P1 + k, i], p[at.EXHAUST_BEND_P1 + k, i])


@helper
def valve_of(p: Array, i: int, k: int) -> valves.Valve:
    """The valve of chamber ``k``."""
    full, leakage, crossing = p[at.CONDUCTANCE, i], p[at.LEAKAGE, i], p[at.CROSSING, i]
    return valves.Valve(supply_edge(p, i, k), exhaust_edge(p, i, k), full, leakage, crossing)


@helper
def orifice_flows(
    p: Array, i: int, k: int, pressure: float, opening: float, inverse: float, inside: float
) -> tuple[float, float]:
    """Mass flows of chamber ``k`` whose spool is at ``opening``: in from the supply and out to the atmosphere, kg/s.

    ``inverse`` is 1/P of the chamber, ``inside`` the coldness of its air.
    """
    fill, drain = driving_flows(p, i, pressure, inverse, inside)
    supply = valves.edge_conductance(opening, supply_edge(p, i, k), p[at.CONDUCTANCE, i], p[at.LEAKAGE_P1 + k, i])
    exhaust = valves.edge_conductance(-opening, exhaust_edge(p, i, k), p[at.CONDUCTANCE, i], p[at.LEAKAGE_P1 + k, i])
    return supply * fill, exhaust * drain


@helper
def exchange(
    p: Array,
    i: int,
    pressure: float,
    temperature: float,
    other: float,
    area: float,
    perimeter: float,
    length: float,
    length_rate: float,
    supplied: float,
    exhausted: float,
    inverse: float,
) -> tuple[float, float]:
    """dP/dt and dT/dt of a chamber under given flows from the supply and to the atmosphere, kg/s.

    ``other`` is the temperature behind its piston, ``length`` that of its air column, m, ``inverse`` 1/(P V T).
    """
    t, wall, gas = temperature, p[at.TEMPERATURE, i], p[at.GAS, i]
    carried = chambers.enthalpy_temperature_flow(supplied, exhausted, t, wall)
    heat = chambers.heat_flow(t, other, wall, length, area, perimeter, p[at.H_WALL, i], p[at.G12, i])
    expansion = pressure * (area * length_rate)
    pressing = chambers.pressing_power(carried, expansion, heat, gas, p[at.GAMMA, i])
    warming = chambers.warming_power(pressing, expansion, supplied - exhausted, gas, t)
    return pressing * (pressure * (t * inverse)), warming * (t * t * inverse)


@helper
def chamber_rates(
    x: Array,
    p: Array,
    dx: Array,
    i: int,
    first: int,
    end: int,
    other: Array,
    area: Array,
    perimeter: Array,
    length: Array,
    length_rate: Array,
) -> None:
    """Writes dP/dt and dT/dt of the chambers from number ``first`` to before ``end``.

    The columns have, a row for each chamber: the temperature behind its piston, area, perimeter, and the length of its air.
    """
    for k in range(first, end):
        pressure, t = x[at.PP1 + 2 * k, i], x[at.TP1 + 2 * k, i]
        volume = p[at.DEAD_VOLUME, i] + area[k] * length[k]
        # One division serves the chamber: 1/(P V) = T inverse, 1/P = V T inverse, 1/T = P V inverse.
        energy = pressure * volume
        inverse = 1.0 / (energy * t)
        coldness = p[at.T0, i] * (energy * inverse)
        supplied, exhausted = orifice_flows(p, i, k, pressure, x[at.S1P + k, i], volume * (t * inverse), coldness)
        dx[at.PP1 + 2 * k], dx[at.TP1 + 2 * k] = exchange(
            p, i, pressure, t, other[k], area[k], perimeter[k], length[k], length_rate[k], supplied, exhausted, inverse
        )


@helper
def air_rates(x: Array, p: Array, dx: Array, i: int, together: int) -> None:
    """Writes dP/dt and dT/dt of the chambers P1, N1, P2 and N2 of lane ``i``, whose state rows stand in this order.

    ``together`` is a constant: 4 has them computed side by side in one vector, 1 one after another, with lanes side by side.
    """
    other, area, perimeter, length, length_rate = column(4), column(4), column(4), column(4), column(4)
    half1, half2, y1, y2, v1, v2 = p[at.HALF_L1, i], p[at.HALF_L2, i], x[at.Y1, i], x[at.Y2, i], x[at.V1, i], x[at.V2, i]
    other[0], other[1], other[2], other[3] = x[at.TN1, i], x[at.TP1, i], x[at.TN2, i], x[at.TP2, i]
    area[0], area[1], area[2], area[3] = p[at.AREA_P1, i], p[at.AREA_N1, i], p[at.AREA_P2, i], p[at.AREA_N2, i]
    perimeter[0], perimeter[1] = p[at.PERIMETER1, i], p[at.PERIMETER1, i]
    perimeter[2], perimeter[3] = p[at.PERIMETER2, i], p[at.PERIMETER2, i]
    length[0], length[1], length[2], length[3] = half1 + y1, half1 - y1, half2 + y2, half2 - y2
    length_rate[0], length_rate[1], length_rate[2], length_rate[3] = v1, -v1, v2, -v2
    for first in range(0, 4, together):
        chamber_rates(x, p, dx, i, first, first + together, other, area, perimeter, length, length_rate)
