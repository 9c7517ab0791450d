"""The right-hand side of the whole rig, written once, and its integrator: kernels over lanes.

State rows are those of ``lanes.STATE_NAMES``. A kernel copies one block of lanes at a time into scratch arrays of constant
shape, works there, and copies back; the right-hand side is inlined where it is used. The rates of a lane, ``dx``, are a column:
they go from the right-hand side to the Runge-Kutta stage in registers.
"""

import math

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK, WARP
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array
from birthsim_env.physics.compiled.shared import anew
from birthsim_env.physics.compiled.stack import column, scratch
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.pneumatics import air
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of
from birthsim_env.physics.seals import friction
from birthsim_env.physics.step import STEP

INTEGRATION_STEP = STEP.seconds
"""s. The longest step of the Runge-Kutta method; the fastest mode (spool, friction, air) is below 8000 1/s."""


@helper
def coulomb_level(x: Array, p: Array, i: int, cylinder: int) -> float:
    """Fc of piston 0 or 1 at its pressures, of the way in which it moves, N."""
    pressure_p, pressure_n = x[at.PP1 + 4 * cylinder, i], x[at.PN1 + 4 * cylinder, i]
    coulomb, growth, asymmetry = (at.FC1, at.FP1, at.ASYMMETRY1) if cylinder == 0 else (at.FC2, at.FP2, at.ASYMMETRY2)
    level = friction.pressed_level(p[coulomb, i], p[growth, i], pressure_p, pressure_n, p[at.ATMOSPHERE, i])
    return friction.level_along(x[at.V1 + 2 * cylinder, i], level, p[asymmetry, i])


@helper
def weakness_of(x: Array, p: Array, i: int, cylinder: int) -> float:
    """1/G(v) of piston 0 or 1, 1/N."""
    fc = coulomb_level(x, p, i, cylinder)
    return friction.inverse_level(x[at.V1 + 2 * cylinder, i], fc, p[at.STATIC_RATIO, i] * fc, p[at.STRIBECK, i])


@helper
def coulomb_levels(state: Array, parameters: Array, levels: Array) -> None:
    """Writes ``coulomb_level`` of both pistons in states (18, N) of rigs (PARAMETERS, N), N, (2, N)."""
    for cylinder in range(2):
        for i in range(state.shape[1]):
            levels[cylinder, i] = coulomb_level(state, parameters, i, cylinder)


@helper
def piston_friction(x: Array, p: Array, i: int, cylinder: int) -> tuple[float, float]:
    """Friction on rod 0 or 1, N, positive along the motion that it holds back, and the rate of its bristle, m/s."""
    v, z, s0 = x[at.V1 + 2 * cylinder, i], x[at.Z1 + cylinder, i], p[at.S0, i]
    fc, fv = coulomb_level(x, p, i, cylinder), (p[at.FV1, i] if cylinder == 0 else p[at.FV2, i])
    weakness = weakness_of(x, p, i, cylinder)
    is_lugre, is_bristle = p[at.LUGRE, i] > 0.5, p[at.BRISTLED, i] > 0.5
    rate = friction.bristle_rate_by_law(v, z, weakness, s0, is_lugre, p[at.BREAKAWAY, i], p[at.STEEPNESS, i])
    held = friction.lugre_force(v, z, rate, s0, p[at.S1, i], fv)
    sliding = friction.coulomb_force(v, fc, fv, p[at.SIGN_SLOPE, i])
    return held if is_bristle else sliding, rate if is_bristle else 0.0


@helper
def lane_rates(x: Array, u: Array, f: Array, p: Array, dx: Array, i: int, together: int) -> None:
    """dx/dt (18,) of lane ``i``: state (18, n), opening commands (4, n), user force (2, n), parameters (PARAMETERS, n).

    ``together`` is that of ``air.air_rates``.
    """
    friction1, dz1 = piston_friction(x, p, i, 0)
    friction2, dz2 = piston_friction(x, p, i, 1)
    dx[at.Z1], dx[at.Z2] = dz1, dz2
    rates_under(x, u, f, p, dx, i, together, friction1, friction2)


@helper
def rates_under(
    x: Array, u: Array, f: Array, p: Array, dx: Array, i: int, together: int, friction1: float, friction2: float
) -> None:
    """``lane_rates`` but for the bristles, for given friction on both rods, N."""
    y1, v1, y2, v2 = x[at.Y1, i], x[at.V1, i], x[at.Y2, i], x[at.V2, i]
    r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
        y1, y2, p[at.K1, i], p[at.K2, i], p[at.D_SQUARES, i], p[at.D_PRODUCT, i], p[at.SIN_GAMMA3, i], p[at.COS_GAMMA3, i]
    )

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
    dx[at.V1] = mechanics.acceleration1(force1, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS1, i], p[at.GRAVITY1, i])
    dx[at.Y2] = v2
    dx[at.V2] = mechanics.acceleration2(force2, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS, i], p[at.GRAVITY, i])
    air.air_rates(x, p, dx, i, together)
    dx[at.S1P] = (u[0, i] - x[at.S1P, i]) * p[at.SPOOL_RATE1, i]
    dx[at.S1N] = (u[1, i] - x[at.S1N, i]) * p[at.SPOOL_RATE1, i]
    dx[at.S2P] = (u[2, i] - x[at.S2P, i]) * p[at.SPOOL_RATE, i]
    dx[at.S2N] = (u[3, i] - x[at.S2N, i]) * p[at.SPOOL_RATE, i]


@helper
def right_hand_side(x: Array, u: Array, f: Array, p: Array, dx: Array, n: int) -> None:
    """``lane_rates`` of ``n`` lanes, (18, n)."""
    for i in range(n):
        lane_rates(x, u, f, p, dx[:, i], i, 1)


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
def stage(
    x: Array, u: Array, f: Array, p: Array, total: Array, trial: Array, n: int, together: int, weight: float, ahead: float
) -> None:
    """Adds ``weight`` times the rates at ``trial`` to ``total`` and puts the next trial state at x + ``ahead`` times them."""
    dx = column(STATES)
    for i in range(n):
        lane_rates(trial, u, f, p, dx, i, together)
        for row in range(STATES):
            total[row, i] += weight * dx[row]
            trial[row, i] = x[row, i] + ahead * dx[row]


@helper
def last_stage(
    x: Array, u: Array, f: Array, p: Array, total: Array, trial: Array, n: int, together: int, weight: float
) -> None:
    """The stage that ends a step: the state, and the first trial state of the next step, are the sum."""
    dx = column(STATES)
    for i in range(n):
        lane_rates(trial, u, f, p, dx, i, together)
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
def take_steps(x: Array, u: Array, f: Array, p: Array, steps: int, step: float, impacts: Array, n: int, together: int) -> None:
    """``integrate`` with the chambers of a lane in vectors of ``together``, see ``air.air_rates``."""
    before, total, trial = scratch(STATES), scratch(STATES), scratch(STATES)
    copy(x, before, n)
    copy(x, total, n)
    copy(x, trial, n)
    for _ in range(steps):
        for k in range(STAGES):
            own = anew(p)
            if k < STAGES - 1 or WARP:
                stage(before, u, f, own, total, trial, n, together, weight_of(k, step), ahead_of(k, step))
            else:
                last_stage(before, u, f, own, total, trial, n, together, weight_of(k, step))
        if WARP:  # with one right-hand side, since two of them are too long for a thread's instructions to stay at hand
            copy(total, before, n)
            copy(total, trial, n)
        record_impacts(total, p, impacts, n)
    copy(total, x, n)


@helper
def integrate(x: Array, u: Array, f: Array, p: Array, steps: int, step: float, impacts: Array, n: int) -> None:
    """Integrates ``n`` lanes of a state ``x`` by ``steps`` Runge-Kutta steps of ``step`` s under constant inputs.

    ``impacts`` (2, n) grows to the largest speed at which each piston ran into an end stop. A lane that is alone has no others
    that would fill a vector, but four chambers.
    """
    if WARP == 0 and (BLOCK == 1 or n == 1):
        take_steps(x, u, f, p, steps, step, impacts, n, 4)
    else:
        take_steps(x, u, f, p, steps, step, impacts, n, 1)


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
