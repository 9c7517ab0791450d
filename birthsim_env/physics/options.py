"""Options of the plant: supply behind a line, tubes between valves and chambers, flexible structure, generalised Maxwell slip.

The first three are off where their parameter is 0 (``supply_conductance``, ``tube_length``, ``mode_frequency``), the last where
another ``law`` of friction is chosen. Plants without any run the kernels of ``dynamics``, which know none of them. With an
option the state has further rows:

- the pressure Ps in a reservoir of volume V, isothermal, which the valves draw from and an ISO 6358 line fills from the source:
  dPs/dt = r T (q(source, Ps) - sum of the valves' supply flows) / V. The line's critical ratio is the valves'.
- flows into and out of each chamber, which follow those of the valve with a lag of the time that sound takes through the tube:
  dq/dt = (q_valve - q) c / L. It stands for the delay L/c of Richer and Hurmuzlu 2000; their attenuation is left out.
- position and velocity of the handle, a part ``mode_mass_fraction`` of the mass that hangs on the linkage's end by spring and
  damper: m_h dvh/dt = Fu - k (xh - xc) - d (vh - vc), k = m_h w^2, d = 2 zeta w m_h, w = 2 pi f. The handle's position is
  counted from where its weight holds it. Hand and tracker are at the handle.
- the deflections of the elements of ``maxwell_slip``, m, and the way in which each slips; of a piston that has them, the
  bristle of the state is their mean, sum c_i z_i.
"""

import numpy as np

from birthsim_env.physics import air, dynamics, friction, maxwell_slip, valves
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.maxwell_slip import ELEMENTS
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of

RESERVOIR, HANDLE, FLOWS, BRISTLES, SLIPS = 0, 1, 5, 13, 13 + 2 * ELEMENTS
"""Further rows: pressure at the valves, Pa; x, y (m), vx, vy (m/s) of the handle; flows of chambers P1, N1, P2, N2, kg/s, four
from the supply and four to the atmosphere; elements of both pistons, their deflections (m) and whether they slip."""
FURTHER = SLIPS + 2 * ELEMENTS
ALL = at.STATES + FURTHER
SCRATCH = 4 * ALL + 8 + at.PARAMETERS


def are_off(parameters: Array) -> bool:
    """Whether no lane has any of the options, (PARAMETERS, N)."""
    return not parameters[[at.LINE, at.MODE_RATE, at.TUBE_RATE, at.GMS]].any()


@helper
def moving_rows(p: Array, n: int) -> int:
    """How many of ``ALL`` rows have rates in ``n`` lanes: those of elements only where a lane has them, and never the last."""
    for i in range(n):
        if p[at.GMS, i] > 0.5:
            return at.STATES + SLIPS
    return at.STATES + BRISTLES


@helper
def alter(p: Array, own: Array, n: int) -> None:
    """Fill ``own`` (PARAMETERS, n), with which ``dynamics`` computes: without the handle's mass, but with all of the weight."""
    for row in range(at.PARAMETERS):
        for i in range(n):
            own[row, i] = p[row, i]
    for i in range(n):
        rest = 1.0 - p[at.HANDLE, i]
        bends = p[at.MODE_RATE, i] > 0.0
        own[at.INVERSE_MASS, i] = p[at.INVERSE_MASS, i] / rest if bends else p[at.INVERSE_MASS, i]
        own[at.GRAVITY, i] = p[at.GRAVITY, i] / rest if bends else p[at.GRAVITY, i]


@helper
def lagged_chamber(
    x: Array,
    p: Array,
    dx: Array,
    i: int,
    chamber: int,
    pressure: int,
    temperature: int,
    other: int,
    spool: int,
    area: int,
    perimeter: int,
    length: float,
    length_rate: float,
) -> float:
    """Rates of a chamber behind a tube, where there is one; returns what its valve draws from the supply, kg/s."""
    supplied, exhausted = air.flows_of(x, p, i, pressure, temperature, spool)
    row = at.STATES + FLOWS + chamber
    rate = p[at.TUBE_RATE, i]
    dx[row], dx[row + 4] = rate * (supplied - x[row, i]), rate * (exhausted - x[row + 4, i])
    if rate > 0.0:
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
            x[row, i],
            x[row + 4, i],
            inverse,
        )
    return supplied


@helper
def element_friction(x: Array, p: Array, dx: Array, i: int, cylinder: int) -> tuple[float, float]:
    """``dynamics.piston_friction`` of a piston with elements, whose rates it writes."""
    v, s0, first = x[at.V1 + 2 * cylinder, i], p[at.S0, i], at.STATES + BRISTLES + ELEMENTS * cylinder
    weakness, deflection, rate = dynamics.weakness_of(x, p, i, cylinder), 0.0, 0.0
    for element in range(ELEMENTS):
        z, most = x[first + element, i], maxwell_slip.reach(element, weakness, s0)
        slips, held = x[first + SLIPS - BRISTLES + element, i] * v > 0.0, maxwell_slip.held_in(v, z, most)
        sliding = maxwell_slip.slip_rate(v, z, most, p[at.ATTRACTION, i] * weakness)
        dx[first + element, i] = sliding if slips else v
        deflection += maxwell_slip.STIFFNESS[element] * (z if slips else held)
        rate += maxwell_slip.STIFFNESS[element] * (sliding if slips else v if held == z else 0.0)
    viscous = p[at.FV1, i] if cylinder == 0 else p[at.FV2, i]
    return friction.lugre_force(v, deflection, rate, s0, p[at.S1, i], viscous), rate


@helper
def switch_elements(before: Array, x: Array, p: Array, step: float, n: int) -> None:
    """After a step from ``before`` to ``x``: which elements slip, how far those are bent that begin to, and the mean of all."""
    for i in range(n):
        if p[at.GMS, i] > 0.5:
            for cylinder in range(2):
                v, s0, mean = x[at.V1 + 2 * cylinder, i], p[at.S0, i], 0.0
                sign, first = (1.0 if v > 0.0 else -1.0), at.STATES + BRISTLES + ELEMENTS * cylinder
                weakness, past = dynamics.weakness_of(x, p, i, cylinder), dynamics.weakness_of(before, p, i, cylinder)
                for row in range(first, first + ELEMENTS):
                    way, most = row + SLIPS - BRISTLES, maxwell_slip.reach(row - first, weakness, s0)
                    slips, along = x[way, i] * v > 0.0, sign * x[row, i]
                    if not slips and along >= most:
                        earlier, attraction = maxwell_slip.reach(row - first, past, s0), p[at.ATTRACTION, i] * weakness
                        x[row, i] = sign * maxwell_slip.caught(sign * before[row, i], along, earlier, most, attraction, step)
                        slips = True
                    x[way, i] = sign if slips else 0.0
                    mean += maxwell_slip.STIFFNESS[row - first] * x[row, i]
                x[at.Z1 + cylinder, i] = mean


@helper
def right_hand_side(
    x: Array, u: Array, f: Array, own: Array, motion: Array, pull: Array, rubbing: Array, dx: Array, n: int
) -> None:
    """dx/dt of ``n`` lanes: state (ALL, n), openings (4, n), user force (2, n), parameters from ``alter``.

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
            rubbing[0, i], dx[at.Z1, i] = element_friction(x, own, dx, i, 0)
            rubbing[1, i], dx[at.Z2, i] = element_friction(x, own, dx, i, 1)
    for i in range(n):
        dynamics.rates_under(x, u, pull, own, dx[:, i], i, 1, rubbing[0, i], rubbing[1, i])
    for i in range(n):
        y1, v1, y2, v2 = x[at.Y1, i], x[at.V1, i], x[at.Y2, i], x[at.V2, i]
        half1, half2, rates = own[at.HALF_L1, i], own[at.HALF_L2, i], dx[:, i]
        drawn = lagged_chamber(
            x, own, rates, i, 0, at.PP1, at.TP1, at.TN1, at.S1P, at.AREA_P1, at.PERIMETER1, half1 + y1, v1
        ) + lagged_chamber(x, own, rates, i, 1, at.PN1, at.TN1, at.TP1, at.S1N, at.AREA_N1, at.PERIMETER1, half1 - y1, -v1)
        drawn += lagged_chamber(
            x, own, rates, i, 2, at.PP2, at.TP2, at.TN2, at.S2P, at.AREA_P2, at.PERIMETER2, half2 + y2, v2
        ) + lagged_chamber(x, own, rates, i, 3, at.PN2, at.TN2, at.TP2, at.S2N, at.AREA_N2, at.PERIMETER2, half2 - y2, -v2)
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
    rubbing, own = scratch[4 * ALL + 6 : 4 * ALL + 8], scratch[4 * ALL + 8 :]
    alter(p, own, n)
    rows = moving_rows(p, n)
    dx[at.STATES + BRISTLES :] = 0.0
    dynamics.copy(state, x[: at.STATES], n)
    dynamics.copy(further, x[at.STATES :], n)
    for _ in range(steps):
        dynamics.copy(x, total, n)
        dynamics.copy(x, trial, n)
        for k in range(STAGES):
            right_hand_side(trial, u, f, own, motion, pull, rubbing, dx, n)
            combine(x, dx, total, trial, rows, n, weight_of(k, step), ahead_of(k, step))
        switch_elements(x, total, own, step, n)
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
def rest(state: Array, parameters: Array, further: Array) -> None:
    """Writes the ``further`` rows (FURTHER, N) with which a state (18, N) begins, its supply that of the source.

    The handle moves with the linkage, unbent, what passes the valves passes the tubes, and the elements of a bristle have been
    loaded from rest.
    """
    for i in range(state.shape[1]):
        further[RESERVOIR, i] = parameters[at.SOURCE, i]
    end_effector_motion(state, parameters, further[HANDLE:FLOWS])
    air.mass_flows(state, parameters, further[FLOWS:BRISTLES])
    for cylinder in range(2):
        for i in range(state.shape[1]):
            v, s0, mean = state[at.V1 + 2 * cylinder, i], parameters[at.S0, i], state[at.Z1 + cylinder, i]
            weakness = dynamics.weakness_of(state, parameters, i, cylinder)
            for element in range(ELEMENTS):
                row, most = BRISTLES + ELEMENTS * cylinder + element, maxwell_slip.reach(element, weakness, s0)
                further[row, i] = maxwell_slip.loaded(element, mean, weakness, s0)
                way = 1.0 if v > 0.0 else -1.0
                slips = v != 0.0 and way * further[row, i] >= most
                further[row + SLIPS - BRISTLES, i] = way if slips else 0.0
