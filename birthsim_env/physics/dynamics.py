"""The right-hand side of the whole rig, written once, and its integrator: kernels over lanes.

State rows are those of ``lanes.STATE_NAMES``. A kernel copies one block of lanes at a time into scratch arrays of constant
shape, works there, and copies back; the right-hand side is inlined where it is used. The rates of a lane, ``dx``, are a column:
they go from the right-hand side to the Runge-Kutta stage in registers.
"""

import math

from birthsim_env.physics import chambers, friction, geometry, mechanics, valves
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK, WARP
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array
from birthsim_env.physics.compiled.shared import anew
from birthsim_env.physics.compiled.stack import column, scratch
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of
from birthsim_env.physics.step import STEP

INTEGRATION_STEP = STEP.seconds
"""s. The longest step of the Runge-Kutta method; the fastest mode (spool, friction, air) is below 8000 1/s."""


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
def orifice_flows(p: Array, i: int, pressure: float, opening: float, inverse: float, inside: float) -> tuple[float, float]:
    """Mass flows of a chamber whose spool is at ``opening``: in from the supply and out to the atmosphere, kg/s.

    ``inverse`` is 1/P of the chamber, ``inside`` the coldness of its air.
    """
    fill, drain = driving_flows(p, i, pressure, inverse, inside)
    supply = valves.supply_conductance(opening, p[at.CONDUCTANCE, i], p[at.LEAKAGE, i])
    exhaust = valves.exhaust_conductance(opening, p[at.CONDUCTANCE, i], p[at.LEAKAGE, i])
    return supply * fill, exhaust * drain


@helper
def flows_of(x: Array, p: Array, i: int, pressure: int, temperature: int, spool: int) -> tuple[float, float]:
    """``orifice_flows`` of a chamber given by its state rows alone."""
    return orifice_flows(p, i, x[pressure, i], x[spool, i], 1.0 / x[pressure, i], p[at.T0, i] / x[temperature, i])


@helper
def chamber_rates(
    p: Array,
    i: int,
    pressure: float,
    temperature: float,
    other: float,
    opening: float,
    area: float,
    perimeter: float,
    length: float,
    length_rate: float,
) -> tuple[float, float]:
    """dP/dt and dT/dt of a chamber; ``other`` is the temperature behind its piston, ``length`` that of its air column, m."""
    volume = p[at.DEAD_VOLUME, i] + area * length
    # One division serves the chamber: 1/(P V) = T inverse, 1/P = V T inverse, 1/T = P V inverse.
    energy = pressure * volume
    inverse = 1.0 / (energy * temperature)
    cold = p[at.T0, i] * (energy * inverse)
    supplied, exhausted = orifice_flows(p, i, pressure, opening, volume * (temperature * inverse), cold)
    return exchange(p, i, pressure, temperature, other, area, perimeter, length, length_rate, supplied, exhausted, inverse)


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
    """``chamber_rates`` under given flows from the supply and to the atmosphere, kg/s; ``inverse`` is 1/(P V T)."""
    t, wall, gas = temperature, p[at.TEMPERATURE, i], p[at.GAS, i]
    carried = chambers.enthalpy_temperature_flow(supplied, exhausted, t, wall)
    heat = chambers.heat_flow(t, other, wall, length, area, perimeter, p[at.H_WALL, i], p[at.G12, i])
    expansion = pressure * (area * length_rate)
    pressing = chambers.pressing_power(carried, expansion, heat, gas, p[at.GAMMA, i])
    warming = chambers.warming_power(pressing, expansion, supplied - exhausted, gas, t)
    return pressing * (pressure * (t * inverse)), warming * (t * t * inverse)


@helper
def air_rates(x: Array, p: Array, dx: Array, i: int) -> None:
    """Writes dP/dt and dT/dt of the chambers P1, N1, P2 and N2 of lane ``i``."""
    length, length_rate, other, area, perimeter = column(4), column(4), column(4), column(4), column(4)
    half1, half2, y1, y2 = p[at.HALF_L1, i], p[at.HALF_L2, i], x[at.Y1, i], x[at.Y2, i]
    length[0], length[1], length[2], length[3] = half1 + y1, half1 - y1, half2 + y2, half2 - y2
    length_rate[0], length_rate[1], length_rate[2], length_rate[3] = x[at.V1, i], -x[at.V1, i], x[at.V2, i], -x[at.V2, i]
    other[0], other[1], other[2], other[3] = x[at.TN1, i], x[at.TP1, i], x[at.TN2, i], x[at.TP2, i]
    area[0], area[1], area[2], area[3] = p[at.AREA_P1, i], p[at.AREA_N1, i], p[at.AREA_P2, i], p[at.AREA_N2, i]
    perimeter[0], perimeter[1] = p[at.PERIMETER1, i], p[at.PERIMETER1, i]
    perimeter[2], perimeter[3] = p[at.PERIMETER2, i], p[at.PERIMETER2, i]
    if BLOCK == 1:
        for c in range(4):  # in one vector: there are no other lanes to fill it
            one_chamber(x, p, dx, i, c, other[c], area[c], perimeter[c], length[c], length_rate[c])
    else:
        one_chamber(x, p, dx, i, 0, other[0], area[0], perimeter[0], length[0], length_rate[0])
        one_chamber(x, p, dx, i, 1, other[1], area[1], perimeter[1], length[1], length_rate[1])
        one_chamber(x, p, dx, i, 2, other[2], area[2], perimeter[2], length[2], length_rate[2])
        one_chamber(x, p, dx, i, 3, other[3], area[3], perimeter[3], length[3], length_rate[3])


@helper
def one_chamber(
    x: Array,
    p: Array,
    dx: Array,
    i: int,
    chamber: int,
    other: float,
    area: float,
    perimeter: float,
    length: float,
    length_rate: float,
) -> None:
    """Writes ``chamber_rates`` of a chamber by its number: its rows follow those of the one before."""
    pressure, temperature = at.PP1 + 2 * chamber, at.TP1 + 2 * chamber
    dx[pressure], dx[temperature] = chamber_rates(
        p, i, x[pressure, i], x[temperature, i], other, x[at.S1P + chamber, i], area, perimeter, length, length_rate
    )


@helper
def piston_friction(
    x: Array, p: Array, i: int, speed: int, bristle: int, coulomb: int, static: int, viscous: int
) -> tuple[float, float]:
    """Friction on a rod, N, positive along the motion that it holds back, and the rate of its bristle, m/s.

    The piston is given by its state rows, and its parameters by theirs.
    """
    v, z, s0, fc, fv = x[speed, i], x[bristle, i], p[at.S0, i], p[coulomb, i], p[viscous, i]
    weakness = friction.inverse_level(v, fc, p[static, i], p[at.STRIBECK, i])
    is_lugre, is_bristle = p[at.LUGRE, i] > 0.5, p[at.LUGRE, i] + p[at.ELASTO_PLASTIC, i] > 0.5
    rate = friction.bristle_rate_by_law(v, z, weakness, s0, is_lugre, p[at.BREAKAWAY, i], p[at.STEEPNESS, i])
    held = friction.lugre_force(v, z, rate, s0, p[at.S1, i], fv)
    sliding = friction.coulomb_force(v, fc, fv, p[at.SIGN_SLOPE, i])
    return held if is_bristle else sliding, rate if is_bristle else 0.0


@helper
def lane_rates(x: Array, u: Array, f: Array, p: Array, dx: Array, i: int) -> None:
    """dx/dt (18,) of lane ``i``: state (18, n), opening commands (4, n), user force (2, n), parameters (PARAMETERS, n)."""
    y1, v1, y2, v2 = x[at.Y1, i], x[at.V1, i], x[at.Y2, i], x[at.V2, i]
    r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
        y1, y2, p[at.K1, i], p[at.K2, i], p[at.D_SQUARES, i], p[at.D_PRODUCT, i], p[at.SIN_GAMMA3, i], p[at.COS_GAMMA3, i]
    )

    friction1, dz1 = piston_friction(x, p, i, at.V1, at.Z1, at.FC1, at.FS1, at.FV1)
    friction2, dz2 = piston_friction(x, p, i, at.V2, at.Z2, at.FC2, at.FS2, at.FV2)
    force1 = (
        mechanics.piston_force(x[at.PP1, i], x[at.PN1, i], p[at.AREA_P1, i], p[at.AREA_N1, i], p[at.ATMOSPHERE, i])
        - friction1
        - mechanics.stop_force(y1, v1, p[at.HALF_L1, i], p[at.STOP_STIFFNESS, i], p[at.STOP_DAMPING, i])
        + mechanics.user_force1(f[0, i], f[1, i], kappa, sine, cosine)
    )
    force2 = (
        mechanics.piston_force(x[at.PP2, i], x[at.PN2, i], p[at.AREA_P2, i], p[at.AREA_N2, i], p[at.ATMOSPHERE, i])
        - friction2
        - mechanics.stop_force(y2, v2, p[at.HALF_L2, i], p[at.STOP_STIFFNESS, i], p[at.STOP_DAMPING, i])
        + mechanics.user_force2(f[0, i], f[1, i], sine, cosine)
    )
    dx[at.Y1] = v1
    dx[at.V1] = mechanics.acceleration1(force1, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS, i], p[at.GRAVITY, i])
    dx[at.Y2] = v2
    dx[at.V2] = mechanics.acceleration2(force2, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS, i], p[at.GRAVITY, i])
    dx[at.Z1], dx[at.Z2] = dz1, dz2

    air_rates(x, p, dx, i)
    dx[at.S1P] = (u[0, i] - x[at.S1P, i]) * p[at.SPOOL_RATE, i]
    dx[at.S1N] = (u[1, i] - x[at.S1N, i]) * p[at.SPOOL_RATE, i]
    dx[at.S2P] = (u[2, i] - x[at.S2P, i]) * p[at.SPOOL_RATE, i]
    dx[at.S2N] = (u[3, i] - x[at.S2N, i]) * p[at.SPOOL_RATE, i]


@helper
def right_hand_side(x: Array, u: Array, f: Array, p: Array, dx: Array, n: int) -> None:
    """``lane_rates`` of ``n`` lanes, (18, n)."""
    for i in range(n):
        lane_rates(x, u, f, p, dx[:, i], i)


@helper
def load(source: Array, first: int, n: int, scratch: Array) -> None:
    """Copy ``n`` lanes, starting at lane ``first``, into the rows of a scratch array."""
    for row in range(source.shape[0]):
        for i in range(n):
            scratch[row, i] = source[row, first + i]


@helper
def store(scratch: Array, first: int, n: int, target: Array) -> None:
    """Copy ``n`` lanes of a scratch array back."""
    for row in range(target.shape[0]):
        for i in range(n):
            target[row, first + i] = scratch[row, i]


@helper
def settle(x: Array, n: int) -> None:
    """Set what has decayed below 1e-30 to zero: arithmetic on denormal numbers is many times slower."""
    for row in range(at.STATES):
        for i in range(n):
            x[row, i] = x[row, i] if abs(x[row, i]) > 1e-30 else 0.0


@kernel
def derivatives(state: Array, command: Array, force: Array, parameters: Array, rates: Array) -> None:
    """Writes d(state)/dt into ``rates`` (18, N)."""
    x, u, f, p, dx = scratch(STATES), scratch(4), scratch(2), scratch(PARAMETERS), scratch(STATES)
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(command, first, n, u)
        load(force, first, n, f)
        load(parameters, first, n, p)
        right_hand_side(x, u, f, p, dx, n)
        store(dx, first, n, rates)


@helper
def mass_flows(state: Array, parameters: Array, flows: Array) -> None:
    """Writes the flows of chambers P1, N1, P2, N2: rows 0-3 from the supply, rows 4-7 to the atmosphere, kg/s, (8, N)."""
    for i in range(state.shape[1]):
        flows[0, i], flows[4, i] = flows_of(state, parameters, i, at.PP1, at.TP1, at.S1P)
        flows[1, i], flows[5, i] = flows_of(state, parameters, i, at.PN1, at.TN1, at.S1N)
        flows[2, i], flows[6, i] = flows_of(state, parameters, i, at.PP2, at.TP2, at.S2P)
        flows[3, i], flows[7, i] = flows_of(state, parameters, i, at.PN2, at.TN2, at.S2N)


@helper
def stage(x: Array, u: Array, f: Array, p: Array, total: Array, trial: Array, n: int, weight: float, ahead: float) -> None:
    """Adds ``weight`` times the rates at ``trial`` to ``total`` and puts the next trial state at x + ``ahead`` times them."""
    dx = column(STATES)
    for i in range(n):
        lane_rates(trial, u, f, p, dx, i)
        for row in range(STATES):
            total[row, i] += weight * dx[row]
            trial[row, i] = x[row, i] + ahead * dx[row]


@helper
def last_stage(x: Array, u: Array, f: Array, p: Array, total: Array, trial: Array, n: int, weight: float) -> None:
    """The stage that ends a step: the state, and the first trial state of the next step, are the sum."""
    dx = column(STATES)
    for i in range(n):
        lane_rates(trial, u, f, p, dx, i)
        for row in range(STATES):
            total[row, i] += weight * dx[row]
            trial[row, i] = total[row, i]
            x[row, i] = total[row, i]


@helper
def copy(source: Array, target: Array, n: int) -> None:
    """Copy as many rows of ``n`` lanes as ``target`` has."""
    for row in range(target.shape[0]):
        for i in range(n):
            target[row, i] = source[row, i]


@helper
def record_impacts(x: Array, p: Array, impacts: Array, n: int) -> None:
    """Keeps the largest speed at which a piston runs into an end stop, m/s."""
    for i in range(n):
        outward1 = x[at.V1, i] if x[at.Y1, i] > 0.0 else -x[at.V1, i]
        outward2 = x[at.V2, i] if x[at.Y2, i] > 0.0 else -x[at.V2, i]
        impacts[0, i] = max(impacts[0, i], outward1 if abs(x[at.Y1, i]) > p[at.HALF_L1, i] else 0.0)
        impacts[1, i] = max(impacts[1, i], outward2 if abs(x[at.Y2, i]) > p[at.HALF_L2, i] else 0.0)


def steps_in(time: float) -> int:
    """Runge-Kutta steps that a force sample held for ``time``, s, is integrated in."""
    return max(1, math.ceil(time / INTEGRATION_STEP - 1e-9))


@helper
def integrate(x: Array, u: Array, f: Array, p: Array, steps: int, step: float, impacts: Array, n: int) -> None:
    """Integrates ``n`` lanes of a state ``x`` by ``steps`` Runge-Kutta steps of ``step`` s under constant inputs.

    ``impacts`` (2, n) grows to the largest speed at which each piston ran into an end stop.
    """
    before, total, trial = scratch(STATES), scratch(STATES), scratch(STATES)
    copy(x, before, n)
    copy(x, total, n)
    copy(x, trial, n)
    for _ in range(steps):
        for k in range(STAGES):
            own = anew(p)
            if k < STAGES - 1 or WARP:
                stage(before, u, f, own, total, trial, n, weight_of(k, step), ahead_of(k, step))
            else:
                last_stage(before, u, f, own, total, trial, n, weight_of(k, step))
        if WARP:  # with one right-hand side, since two of them are too long for a thread's instructions to stay at hand
            copy(total, before, n)
            copy(total, trial, n)
        record_impacts(total, p, impacts, n)
    copy(total, x, n)


@kernel
def advance(state: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, impacts: Array) -> None:
    """Integrates ``state`` in place by Runge-Kutta.

    ``forces`` (K, 2, N): each of the K samples is held for ``steps`` steps of ``step`` seconds. ``impacts`` (2, N) gets
    the largest speed at which each piston ran into an end stop.
    """
    x, u, f, p, hit = scratch(STATES), scratch(4), scratch(2), scratch(PARAMETERS), scratch(2)
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(command, first, n, u)
        load(parameters, first, n, p)
        hit[:] = 0.0
        for sample in range(forces.shape[0]):
            load(forces[sample], first, n, f)
            integrate(x, u, f, p, steps, step, hit, n)
        settle(x, n)
        store(x, first, n, state)
        store(hit, first, n, impacts)
