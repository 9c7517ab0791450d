"""Options of the plant: a supply behind a line, tubes between valves and chambers, a handle on a flexible structure.

Each is off where its parameter is 0 (``supply_conductance``, ``tube_length``, ``mode_frequency``). Plants without any run the
kernels of ``dynamics``, which know none of them. With an option the state has further rows:

- the pressure Ps in a reservoir of volume V, isothermal, which the valves draw from and an ISO 6358 line fills from the source:
  dPs/dt = r T (q(source, Ps) - sum of the valves' supply flows) / V. The line's critical ratio is the valves'.
- flows into and out of each chamber, which follow those of the valve with a lag of the time that sound takes through the tube:
  dq/dt = (q_valve - q) c / L. It stands for the delay L/c of Richer and Hurmuzlu 2000; their attenuation is left out.
- position and velocity of the handle, a part ``mode_mass_fraction`` of the mass that hangs on the linkage's end by spring and
  damper: m_h dvh/dt = Fu - k (xh - xc) - d (vh - vc), k = m_h w^2, d = 2 zeta w m_h, w = 2 pi f. The handle's position is
  counted from where its weight holds it. Hand and tracker are at the handle.
"""

import numpy as np

from birthsim_env.physics import air, dynamics, valves
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of

RESERVOIR, HANDLE, FLOWS = 0, 1, 5
"""Further rows: pressure at the valves, Pa; x, y (m), vx, vy (m/s) of the handle; flows of chambers P1, N1, P2, N2, kg/s, four
from the supply and four to the atmosphere."""
FURTHER = 13
ALL = at.STATES + FURTHER
SCRATCH = 4 * ALL + 6 + at.PARAMETERS


def are_off(parameters: Array) -> bool:
    """Whether no lane has any of the options, (PARAMETERS, N)."""
    return not parameters[[at.LINE, at.MODE_RATE, at.TUBE_RATE]].any()


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
    area: int,
    perimeter: int,
    length: float,
    length_rate: float,
) -> float:
    """Rates of a chamber behind a tube, where there is one; returns what its valve draws from the supply, kg/s."""
    supplied, exhausted = air.flows_of(x, p, i, chamber)
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
def right_hand_side(x: Array, u: Array, f: Array, own: Array, motion: Array, pull: Array, dx: Array, n: int) -> None:
    """dx/dt of ``n`` lanes: state (ALL, n), openings (4, n), user force (2, n), parameters from ``alter``.

    Scratch: ``motion`` (4, n) of the linkage's end, and ``pull`` (2, n), the force on it.
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
    dynamics.right_hand_side(x, u, pull, own, dx, n)
    for i in range(n):
        y1, v1, y2, v2 = x[at.Y1, i], x[at.V1, i], x[at.Y2, i], x[at.V2, i]
        half1, half2, rates = own[at.HALF_L1, i], own[at.HALF_L2, i], dx[:, i]
        drawn = lagged_chamber(
            x, own, rates, i, 0, at.PP1, at.TP1, at.TN1, at.AREA_P1, at.PERIMETER1, half1 + y1, v1
        ) + lagged_chamber(x, own, rates, i, 1, at.PN1, at.TN1, at.TP1, at.AREA_N1, at.PERIMETER1, half1 - y1, -v1)
        drawn += lagged_chamber(
            x, own, rates, i, 2, at.PP2, at.TP2, at.TN2, at.AREA_P2, at.PERIMETER2, half2 + y2, v2
        ) + lagged_chamber(x, own, rates, i, 3, at.PN2, at.TN2, at.TP2, at.AREA_N2, at.PERIMETER2, half2 - y2, -v2)
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
def combine(x: Array, dx: Array, total: Array, trial: Array, n: int, weight: float, ahead: float) -> None:
    """Adds ``weight`` dx to the running sum and puts the next trial state at x + ``ahead`` dx."""
    for row in range(ALL):
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
    motion, pull, own = scratch[4 * ALL : 4 * ALL + 4], scratch[4 * ALL + 4 : 4 * ALL + 6], scratch[4 * ALL + 6 :]
    alter(p, own, n)
    dynamics.copy(state, x[: at.STATES], n)
    dynamics.copy(further, x[at.STATES :], n)
    for _ in range(steps):
        dynamics.copy(x, total, n)
        dynamics.copy(x, trial, n)
        for k in range(STAGES):
            right_hand_side(trial, u, f, own, motion, pull, dx, n)
            combine(x, dx, total, trial, n, weight_of(k, step), ahead_of(k, step))
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

    The handle moves with the linkage, unbent, and what passes the valves passes the tubes.
    """
    for i in range(state.shape[1]):
        further[RESERVOIR, i] = parameters[at.SOURCE, i]
    end_effector_motion(state, parameters, further[HANDLE:FLOWS])
    air.mass_flows(state, parameters, further[FLOWS:])
