"""Row numbers of the arrays that kernels share: the state (18, N) and the parameters of every lane.

A lane is one environment. Arrays are laid out quantity by quantity, (rows, N), so that a kernel's innermost loop walks
over lanes with unit stride.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics import valves
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.physics.rig.parameters import Parameters

Array = NDArray[np.float64]

STATE_NAMES = (
    *("y1", "v1", "y2", "v2", "z1", "z2"),
    *("Pp1", "Tp1", "Pn1", "Tn1", "Pp2", "Tp2", "Pn2", "Tn2"),
    *("s1P", "s1N", "s2P", "s2N"),
)
"""Rows of the state: piston positions (m) and speeds (m/s), bristle deflections (m), chamber pressures (Pa) and
temperatures (K), spool openings (-)."""

STATE_UNITS = (*("m", "m/s") * 2, "m", "m", *("Pa", "K") * 4, *("1",) * 4)
STATES = len(STATE_NAMES)
Y1, V1, Y2, V2, Z1, Z2, PP1, TP1, PN1, TN1, PP2, TP2, PN2, TN2, S1P, S1N, S2P, S2N = range(STATES)
PRESSURES = (PP1, PN1, PP2, PN2)
TEMPERATURES = (TP1, TN1, TP2, TN2)
SPOOLS = (S1P, S1N, S2P, S2N)

SHORTEST_TUBE = 0.05
"""m. A shorter tube has the lag of one of this length, 0.15 ms, which steps of 0.25 ms follow."""


class Rig(Numbers):
    """The parameters of one rig, as controllers and plants compute with them.

    Those from ``knee`` to ``inverse_mass`` spare divisions; those from ``source`` on are of ``physics.options``.
    """

    d_squares = number("m2", "d3^2 + d6^2")
    d_product = number("m2", "2 d3 d6")
    sin_gamma3 = number("1", "sin(gamma3)")
    cos_gamma3 = number("1", "cos(gamma3)")
    k1 = number("m", "offset of cylinder 1")
    k2 = number("m", "offset of cylinder 2")
    half_l1 = number("m", "half the stroke of cylinder 1")
    half_l2 = number("m", "half the stroke of cylinder 2")
    mass = number("kg", "moved mass")
    gravity = number("m/s2", "gravity")
    stop_stiffness = number("N/m", "of the end stops")
    stop_damping = number("N s/m", "of the end stops")
    lugre = number("1", "1 with the friction law of that name, else 0")
    fc1 = number("N", "Coulomb friction")
    fc2 = number("N", "Coulomb friction")
    fs1 = number("N", "static friction")
    fs2 = number("N", "static friction")
    fv1 = number("N s/m", "viscous friction")
    fv2 = number("N s/m", "viscous friction")
    stribeck = number("m/s", "Stribeck speed")
    s0 = number("N/m", "bristle stiffness")
    s1 = number("N s/m", "bristle damping")
    sign_speed = number("m/s", "width of the smoothed sign")
    elasto_plastic = number("1", "1 with the friction law of that name, else 0")
    breakaway = number("1", "breakaway deflection over the steady one")
    steepness = number("1", "1/(1 - breakaway)")
    area_p1 = number("m2", "of a piston")
    area_n1 = number("m2", "of a piston")
    area_p2 = number("m2", "of a piston")
    area_n2 = number("m2", "of a piston")
    perimeter1 = number("m", "of a piston")
    perimeter2 = number("m", "of a piston")
    dead_volume = number("m3", "of a chamber, with that of its tube")
    h_wall = number("W/(m2 K)", "heat transfer of the walls")
    g12 = number("W/K", "conductance of a piston")
    conductance = number("m3/(s Pa)", "sonic conductance")
    critical = number("1", "critical pressure ratio")
    leakage = number("m3/(s Pa)", "leakage conductance")
    tau = number("s", "time constant of a spool")
    supply = number("Pa", "pressure at the valves now")
    atmosphere = number("Pa", "pressure of the surroundings")
    temperature = number("K", "of supply and surroundings")
    gas = number("J/(kg K)", "gas constant")
    gamma = number("1", "ratio of heat capacities")
    index = number("1", "polytropic index of the control model")
    rho0 = number("kg/m3", "reference density")
    t0 = number("K", "reference temperature")
    knee = number("1", "1/(1 - critical)")
    laminar = number("1", "of ``valves.laminar_slope``")
    coldness = number("1", "T0/T of supply and surroundings")
    inverse_supply = number("1/Pa", "1/supply")
    inverse_atmosphere = number("1/Pa", "1/atmosphere")
    spool_rate = number("1/s", "1/tau")
    sign_slope = number("s/m", "1/sign_speed")
    inverse_mass = number("1/kg", "1/mass")
    deadband = number("1", "of a spool")
    play = number("1", "of a spool")
    opening_limit = number("1", "of a spool")
    source = number("Pa", "supply pressure to begin with and before the line")
    line = number("m3/(s Pa)", "conductance of the line")
    line_gain = number("Pa/kg", "r T/V of the reservoir")
    mode_rate = number("1/s", "2 pi f of the soft structure")
    mode_damping = number("1", "damping ratio of the soft structure")
    handle = number("1", "the handle's share of the mass")
    tube_rate = number("1/s", "c/L of the tubes")


PARAMETER_NAMES, PARAMETER_UNITS = tuple(Rig.groups), tuple(group.units[0] for group in Rig.groups.values())
PARAMETERS = len(PARAMETER_NAMES)
(
    D_SQUARES, D_PRODUCT, SIN_GAMMA3, COS_GAMMA3, K1, K2, HALF_L1, HALF_L2, MASS, GRAVITY, STOP_STIFFNESS, STOP_DAMPING,
    LUGRE, FC1, FC2, FS1, FS2, FV1, FV2, STRIBECK, BRISTLE_S0, BRISTLE_S1, SIGN_SPEED, ELASTO_PLASTIC, BREAKAWAY, STEEPNESS,
    AREA_P1, AREA_N1, AREA_P2, AREA_N2, PERIMETER1, PERIMETER2, DEAD_VOLUME, H_WALL, G12, CONDUCTANCE, CRITICAL, LEAKAGE, TAU,
    SUPPLY, ATMOSPHERE, TEMPERATURE, GAS, GAMMA, INDEX, RHO0, T0, KNEE, LAMINAR, COLDNESS, INVERSE_SUPPLY, INVERSE_ATMOSPHERE,
    SPOOL_RATE, SIGN_SLOPE, INVERSE_MASS, DEADBAND, PLAY, OPENING_LIMIT, SOURCE, LINE, LINE_GAIN, MODE_RATE, MODE_DAMPING,
    HANDLE, TUBE_RATE,
) = range(PARAMETERS)  # fmt: skip


def parameter_column(parameters: Parameters) -> Array:
    """``Rig`` of one rig: one lane's column of the parameter array, (PARAMETERS,), SI units."""
    return np.array(rows_of(parameters), dtype=np.float64)


def parameter_columns(parameters: Parameters, num_lanes: int) -> Array:
    """``parameter_column`` of lanes (PARAMETERS, num_lanes); fields of ``parameters`` but geometry may be (num_lanes,)."""
    columns = np.empty((PARAMETERS, num_lanes))
    for row, value in zip(columns, rows_of(parameters), strict=True):
        row[:] = value
    return columns


def rows_of(parameters: Any) -> tuple[Any, ...]:
    """The rows of ``parameter_column`` in order; what has the sections of ``Parameters`` may hold arrays or expressions."""
    g, c1, c2, m = parameters.geometry, parameters.cylinder1, parameters.cylinder2, parameters.mechanics
    f, ch, v, a = parameters.friction, parameters.chambers, parameters.valves, parameters.air
    fc1, fc2 = c1.coulomb_friction, c2.coulomb_friction
    conductance = v.sonic_conductance
    tube = np.pi / 4 * ch.tube_diameter * ch.tube_diameter * ch.tube_length
    sound = np.sqrt(a.heat_capacity_ratio * a.gas_constant * a.temperature)
    tube_rate = np.where(np.greater(ch.tube_length, 0.0), sound / np.maximum(ch.tube_length, SHORTEST_TUBE), 0.0)
    return (
        *(g.d3 * g.d3 + g.d6 * g.d6, 2 * g.d3 * g.d6, exact.number("sine", g.gamma3), exact.number("cosine", g.gamma3)),
        *(g.k1, g.k2, c1.stroke / 2, c2.stroke / 2),
        *(m.mass, m.gravity, m.stop_stiffness, m.stop_damping),
        *(float(f.law == "lugre"), fc1, fc2, f.static_ratio * fc1, f.static_ratio * fc2),
        *(c1.viscous_friction, c2.viscous_friction, f.stribeck_speed, f.bristle_stiffness, f.bristle_damping, f.sign_speed),
        *(float(f.law == "elasto_plastic"), f.breakaway_ratio, 1 / (1 - f.breakaway_ratio)),
        *(c1.area_p, c1.area_n, c2.area_p, c2.area_n, np.pi * c1.piston_diameter, np.pi * c2.piston_diameter),
        *(ch.dead_volume + tube, ch.wall_heat_transfer, ch.piston_conductance),
        *(conductance, v.critical_ratio, v.leakage_ratio * conductance, v.time_constant),
        *(a.supply_pressure, a.atmospheric_pressure, a.temperature),
        *(a.gas_constant, a.heat_capacity_ratio, a.polytropic_index, a.reference_density, a.reference_temperature),
        *(1 / (1 - v.critical_ratio), valves.laminar_slope(v.critical_ratio)),
        *(a.reference_temperature / a.temperature, 1 / a.supply_pressure, 1 / a.atmospheric_pressure),
        *(1 / v.time_constant, 1 / f.sign_speed, 1 / m.mass),
        *(v.deadband, v.hysteresis, v.opening_limit),
        *(a.supply_pressure, a.supply_conductance, a.gas_constant * a.temperature / a.supply_volume),
        *(2 * np.pi * m.mode_frequency, m.mode_damping, m.mode_mass_fraction, tube_rate),
    )


def parameter_array(parameters: Parameters | Sequence[Parameters], num_lanes: int) -> Array:
    """Parameters of all lanes, (PARAMETERS, num_lanes): one rig for all, or a sequence with one per lane."""
    if isinstance(parameters, Parameters):
        return parameter_columns(parameters, num_lanes)
    if len(parameters) != num_lanes:
        raise ValueError(
            f"parameters has {len(parameters)} entries; allowed: one Parameters, or one for each of {num_lanes} lanes"
        )
    for lane, rig in enumerate(parameters):
        if not isinstance(rig, Parameters):
            raise ValueError(f"parameters[{lane}] = {rig!r}; allowed: a Parameters")
    return np.stack([parameter_column(p) for p in parameters], axis=1)
