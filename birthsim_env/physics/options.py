"""Options of the plant: supply behind a line, tubes between valves and chambers, flexible structure, generalised Maxwell slip.

The first three are off where their parameter is 0 (``supply_conductance``, ``tube_length``, ``mode_frequency``), the last where
another ``law`` of friction is chosen. Plants without any run the kernels of ``dynamics``, which know none of them. With an
option the state has further rows:

- the pressure Ps in a reservoir of volume V, isothermal, which the valves draw from and an ISO 6358 line fills from the source:
  dPs/dt = r T (q(source, Ps) - sum of the valves' supply flows) / V. The line's critical ratio is the valves'.
- the pressure at the valve's end of each tube, and the flow through it into the chamber (``tubes``).
- position and velocity of the handle, a part ``mode_mass_fraction`` of the mass that hangs on the linkage's end by spring and
  damper: m_h dvh/dt = Fu - k (xh - xc) - d (vh - vc), k = m_h w^2, d = 2 zeta w m_h, w = 2 pi f. The handle's position is
  counted from where its weight holds it. Hand and tracker are at the handle.
- the deflections of the elements of ``maxwell_slip``, m, and the way in which each slips; of a piston that has them, the
  bristle of the state is their mean, sum c_i z_i.
"""

import numpy as np

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import end_effector_motion
from birthsim_env.physics.pneumatics import air, tubes, valves
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of
from birthsim_env.physics.seals import maxwell_slip

RESERVOIR, HANDLE, TUBES, FLOWS, BRISTLES = 0, 1, 5, 9, 13
"""Further rows: pressure at the valves, Pa; x, y (m), vx, vy (m/s) of the handle; of the tubes of chambers P1, N1, P2, N2 four
pressures at the valves' ends, Pa, and four flows into the chambers, kg/s; what ``maxwell_slip`` has of both pistons."""
FURTHER = BRISTLES + maxwell_slip.ROWS
ALL = at.STATES + FURTHER
SCRATCH = 4 * ALL + 8 + at.PARAMETERS + tubes.CONSTANTS


def are_off(parameters: Array) -> bool:
    """Whether no lane has any of the options, (PARAMETERS, N)."""
    return not parameters[[at.LINE, at.MODE_RATE, at.TUBE_LENGTH, at.GMS]].any()


@helper
def moving_rows(p: Array, n: int) -> int:
    """How many of ``ALL`` rows have rates in ``n`` lanes: those of elements only where a lane has them, and never the last."""
    for i in range(n):
        if p[at.GMS, i] > 0.5:
            return at.STATES + BRISTLES + maxwell_slip.MOVING
    return at.STATES + BRISTLES


@helper
def alter(p: Array, own: Array, tube: Array, n: int) -> None:
    """Fill ``own`` (PARAMETERS, n), with which ``dynamics`` computes: without the handle's mass, but with all of the weight.

    ``tube`` (tubes.CONSTANTS, n) gets what the tubes' rates are computed from.
    """
    tubes.fill_constants(p, tube, n)
    for row in range(at.PARAMETERS):
        for i in range(n):
            own[row, i] = p[row, i]
    for i in range(n):
        rest = 1.0 - p[at.HANDLE, i]
        bends = p[at.MODE_RATE, i] > 0.0
        for row in (at.INVERSE_MASS, at.INVERSE_MASS1, at.GRAVITY, at.GRAVITY1):
            own[row, i] = p[row, i] / rest if bends else p[row, i]


@helper
def tubed_chamber(
    x: Array,
    p: Array,
    tube: Array,
    dx: Array,
    i: int,
    chamber: int,
    pressure: int,
    temperature: int,
    other: int,
    area: int,
    perimeter: int,
    length: float,
    length_rate: float,
) -> float:
    """Rates of a tube and of the chamber behind it, where there is one; returns what its valve draws from the supply, kg/s."""
    row, through, has_tube = at.STATES + TUBES + chamber, at.STATES + FLOWS + chamber, p[at.TUBE_LENGTH, i] > 0.0
    end, outer = tubes.at_valve(p, i, x[row, i], x[pressure, i], x[temperature, i])
    supplied, exhausted = air.orifice_flows(p, i, chamber, end, x[at.S1P + chamber, i], 1.0 / end, outer)
    flow = x[through, i]
    coldness = outer if end > x[pressure, i] else p[at.T0, i] / x[temperature, i]
    inertance, viscous = tube[tubes.INERTANCE, i], tube[tubes.VISCOUS, i]
    resistance, critical = tube[tubes.RESISTANCE, i], tube[tubes.CRITICAL, i]
    pushed = tubes.flow_rate(end, x[pressure, i], flow, coldness, inertance, viscous, resistance, critical)
    dx[row] = tube[tubes.GAIN, i] * (supplied - exhausted - flow) if has_tube else 0.0
    dx[through] = pushed if has_tube else 0.0
    if has_tube:
        inverse = 1.0 / (x[pressure, i] * (p[at.DEAD_VOLUME, i] + p[area, i] * length) * x[temperature, i])
        dx[pressure], dx[temperature] = air.exchange(
            p,
            i,
            x[pressure, i],
            x[temperature, i],
            x[other, i],
            p[area, i],
            p[perimeter, i],
            length,
            length_rate,
            flow,
            0.0,
            inverse,
        )
    return supplied


@helper
def right_hand_side(
    x: Array, u: Array, f: Array, own: Array, tube: Array, motion: Array, pull: Array, rubbing: Array, dx: Array, n: int
) -> None:
    """dx/dt of ``n`` lanes: state (ALL, n), openings (4, n), user force (2, n), ``own`` and ``tube`` from ``alter``.

    Scratch: ``motion`` (4, n) of the linkage's end, and ``pull`` (2, n), the force on it; ``rubbing`` (2, n), friction. Rates
    of elements stay as they are, zero, in lanes without.
    """
    end_effector_motion(x[: at.STATES, :n], own[:, :n], motion[:, :n])
    for i in range(n):
        supply = x[at.STATES + RESERVOIR, i] if own[at.LINE, i] > 0.0 else own[at.SOURCE, i]
        own[at.SUPPLY, i], own[at.INVERSE_SUPPLY, i] = supply, 1.0 / supply
        rate, mass, bends = own[at.MODE_RATE, i], own[at.HANDLE, i] * own[at.MASS, i], own[at.MODE_RATE, i] > 0.0
        for axis in range(2):
            place, speed = at.STATES + HANDLE + axis, at.STATES + HANDLE + 2 + axis
            bent, bending = x[place, i] - motion[axis, i], x[speed, i] - motion[2 + axis, i]
            spring = mass * rate * (rate * bent + 2.0 * own[at.MODE_DAMPING, i] * bending)
            pull[axis, i] = spring if bends else f[axis, i]
            dx[place, i] = x[speed, i]
            dx[speed, i] = (f[axis, i] - spring) / mass if bends else 0.0
    for i in range(n):
        rubbing[0, i], dx[at.Z1, i] = dynamics.piston_friction(x, own, i, 0)
        rubbing[1, i], dx[at.Z2, i] = dynamics.piston_friction(x, own, i, 1)
    for i in range(n):
        if own[at.GMS, i] > 0.5:
            rubbing[0, i], dx[at.Z1, i] = maxwell_slip.piston_friction(x, own, dx, i, 0, at.STATES + BRISTLES)
            rubbing[1, i], dx[at.Z2, i] = maxwell_slip.piston_friction(x, own, dx, i, 1, at.STATES + BRISTLES)
    for i in range(n):
        dynamics.rates_under(x, u, pull, own, dx[:, i], i, 1, rubbing[0, i], rubbing[1, i])
    for i in range(n):
        y1, v1, y2, v2 = x[at.Y1, i], x[at.V1, i], x[at.Y2, i], x[at.V2, i]
        half1, half2, rates = own[at.HALF_L1, i], own[at.HALF_L2, i], dx[:, i]
        drawn = tubed_chamber(
            x, own, tube, rates, i, 0, at.PP1, at.TP1, at.TN1, at.AREA_P1, at.PERIMETER1, half1 + y1, v1
        ) + tubed_chamber(x, own, tube, rates, i, 1, at.PN1, at.TN1, at.TP1, at.AREA_N1, at.PERIMETER1, half1 - y1, -v1)
        drawn += tubed_chamber(
            x, own, tube, rates, i, 2, at.PP2, at.TP2, at.TN2, at.AREA_P2, at.PERIMETER2, half2 + y2, v2
        ) + tubed_chamber(x, own, tube, rates, i, 3, at.PN2, at.TN2, at.TP2, at.AREA_N2, at.PERIMETER2, half2 - y2, -v2)
        source, supply, inverse = own[at.SOURCE, i], own[at.SUPPLY, i], own[at.INVERSE_SUPPLY, i]
        filled = own[at.LINE, i] * valves.driving_flow(
            source,
            1.0 / source,
            own[at.COLDNESS, i],
            supply,
            inverse,
            own[at.COLDNESS, i],
            own[at.RHO0, i],
            own[at.CRITICAL, i],
            own[at.KNEE, i],
            own[at.LAMINAR, i],
        )
        dx[at.STATES + RESERVOIR, i] = own[at.LINE_GAIN, i] * (filled - drawn) if own[at.LINE, i] > 0.0 else 0.0


@helper
def combine(x: Array, dx: Array, total: Array, trial: Array, rows: int, n: int, weight: float, ahead: float) -> None:
    """Adds ``weight`` dx to the running sum and puts the next trial state at x + ``ahead`` dx, of the first ``rows``."""
    for row in range(rows):
        for i in range(n):
            total[row, i] += weight * dx[row, i]
            trial[row, i] = x[row, i] + ahead * dx[row, i]


@helper
def integrate(
    state: Array, further: Array, u: Array, f: Array, p: Array, steps: int, step: float, impacts: Array, scratch: Array, n: int
) -> None:
    """``dynamics.integrate`` with options: moves ``state`` (18, n) and ``further`` (FURTHER, n), and keeps the supply of ``p``.

    ``scratch`` is (SCRATCH, BLOCK).
    """
    x, dx, total, trial = scratch[:ALL], scratch[ALL : 2 * ALL], scratch[2 * ALL : 3 * ALL], scratch[3 * ALL : 4 * ALL]
    motion, pull = scratch[4 * ALL : 4 * ALL + 4], scratch[4 * ALL + 4 : 4 * ALL + 6]
    rubbing, more = scratch[4 * ALL + 6 : 4 * ALL + 8], scratch[4 * ALL + 8 :]
    own, tube = more[: at.PARAMETERS], more[at.PARAMETERS :]
    alter(p, own, tube, n)
    rows = moving_rows(p, n)
    dx[at.STATES + BRISTLES :] = 0.0
    dynamics.copy(state, x[: at.STATES], n)
    dynamics.copy(further, x[at.STATES :], n)
    for _ in range(steps):
        dynamics.copy(x, total, n)
        dynamics.copy(x, trial, n)
        for k in range(STAGES):
            right_hand_side(trial, u, f, own, tube, motion, pull, rubbing, dx, n)
            combine(x, dx, total, trial, rows, n, weight_of(k, step), ahead_of(k, step))
        maxwell_slip.switch_elements(x, total, own, at.STATES + BRISTLES, step, n)
        dynamics.copy(total, x, n)
        dynamics.record_impacts(x, p, impacts, n)
    dynamics.settle(x, n)
    dynamics.copy(x[: at.STATES], state, n)
    dynamics.copy(x[at.STATES :], further, n)
    for i in range(n):
        if p[at.LINE, i] > 0.0:
            p[at.SUPPLY, i], p[at.INVERSE_SUPPLY, i] = further[RESERVOIR, i], 1.0 / further[RESERVOIR, i]


@kernel
def advance(
    state: Array, further: Array, command: Array, forces: Array, parameters: Array, steps: int, step: float, impacts: Array
) -> None:
    """``dynamics.advance`` with options; ``further`` (FURTHER, N) moves along, and so does the supply of ``parameters``."""
    scratch = np.empty((SCRATCH, BLOCK))
    impacts[:] = 0.0
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        mine = slice(first, first + n)
        for sample in range(forces.shape[0]):
            integrate(
                state[:, mine],
                further[:, mine],
                command[:, mine],
                forces[sample][:, mine],
                parameters[:, mine],
                steps,
                step,
                impacts[:, mine],
                scratch,
                n,
            )


@helper
def port_motion(state: Array, further: Array, p: Array, motion: Array) -> None:
    """Writes x, y, vx, vy of the end effector (4, N): of the handle where the structure bends."""
    end_effector_motion(state, p, motion)
    for i in range(state.shape[1]):
        if p[at.MODE_RATE, i] > 0.0:
            for row in range(4):
                motion[row, i] = further[HANDLE + row, i]


@helper
def mass_flows(state: Array, further: Array, parameters: Array, flows: Array) -> None:
    """Writes the flows at the valves of chambers P1, N1, P2, N2: 0-3 from the supply, 4-7 to the atmosphere, kg/s, (8, N)."""
    for k in range(4):
        for i in range(state.shape[1]):
            pressure, temperature = state[at.PRESSURES[k], i], state[at.TEMPERATURES[k], i]
            end, coldness = tubes.at_valve(parameters, i, further[TUBES + k, i], pressure, temperature)
            opening = state[at.SPOOLS[k], i]
            flows[k, i], flows[4 + k, i] = air.orifice_flows(parameters, i, k, end, opening, 1.0 / end, coldness)


@helper
def rest(state: Array, parameters: Array, further: Array) -> None:
    """Writes the ``further`` rows (FURTHER, N) with which a state (18, N) begins, its supply that of the source.

    The handle moves with the linkage, unbent, the air in the tubes stands still at the chambers' pressures,
    and the elements of bristles have been loaded from rest.
    """
    for i in range(state.shape[1]):
        further[RESERVOIR, i] = parameters[at.SOURCE, i]
        for chamber in range(4):
            further[TUBES + chamber, i], further[FLOWS + chamber, i] = state[at.PRESSURES[chamber], i], 0.0
    end_effector_motion(state, parameters, further[HANDLE:TUBES])
    maxwell_slip.rest(state, parameters, further[BRISTLES:])
