"""States to start from: pistons at given positions and speeds, chambers balanced at a pneumatic stiffness."""

import math

import numpy as np

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.seals import friction

PASSES = 8
"""Of pressures by friction and friction by pressures, each of which leaves some 4 % of the error."""

REST_SPEED = 1e-9
"""m/s: a slower piston starts at rest, without friction. Rounding leaves 1e-17, and its sign must not choose the friction's."""


@helper
def balance(state: Array, stiffness: Array, p: Array) -> None:
    """Fills pressures, temperatures and bristles of a state whose positions and speeds are set."""
    for i in range(state.shape[1]):
        y1, y2 = state[at.Y1, i], state[at.Y2, i]
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p[at.K1, i], p[at.K2, i], p[at.D_SQUARES, i], p[at.D_PRODUCT, i], p[at.SIN_GAMMA3, i], p[at.COS_GAMMA3, i]
        )
        weight1 = p[at.MASS, i] * kappa * p[at.GRAVITY, i] * sine
        weight2 = p[at.MASS, i] * p[at.GRAVITY, i] * cosine
        for cylinder in range(2):
            v, z, pp, pn = (at.V1, at.Z1, at.PP1, at.PN1) if cylinder == 0 else (at.V2, at.Z2, at.PP2, at.PN2)
            fv = at.FV1 if cylinder == 0 else at.FV2
            ap, an = (p[at.AREA_P1, i], p[at.AREA_N1, i]) if cylinder == 0 else (p[at.AREA_P2, i], p[at.AREA_N2, i])
            half = p[at.HALF_L1, i] if cylinder == 0 else p[at.HALF_L2, i]
            y = y1 if cylinder == 0 else y2
            speed = state[v, i] if abs(state[v, i]) > REST_SPEED else 0.0
            has_bristle = p[at.BRISTLED, i] > 0.5
            weight = weight1 if cylinder == 0 else weight2
            length_p, length_n = half + y, half - y
            low, high = p[at.ATMOSPHERE, i], p[at.SOURCE, i]
            state[pp, i], state[pn, i] = low, low
            for _ in range(PASSES):
                fc = dynamics.coulomb_level(state, p, i, cylinder)
                level = friction.stribeck_level(speed, fc, p[at.STATIC_RATIO, i] * fc, p[at.STRIBECK, i])
                sliding = level if has_bristle else fc
                drag = (math.copysign(sliding, speed) if speed != 0.0 else 0.0) + p[fv, i] * speed
                force = p[at.ATMOSPHERE, i] * (ap - an) + drag - weight
                # F = a - b and K/k = a/Lp + b/Ln, (3) and (9), are linear in a = Pp Sp and b = Pn Sn.
                a = (stiffness[cylinder, i] / p[at.INDEX, i] + force / length_n) / (1.0 / length_p + 1.0 / length_n)
                a = max(max(low * ap, low * an + force), min(min(high * ap, high * an + force), a))
                state[pp, i] = a / ap
                state[pn, i] = (a - force) / an
            state[z, i] = friction.steady_deflection(speed, level, p[at.S0, i]) if has_bristle else 0.0
        for row in at.TEMPERATURES:
            state[row, i] = p[at.TEMPERATURE, i]
        for row in at.SPOOLS:
            state[row, i] = 0.0


def balanced_state(
    lane_parameters: Array, piston: Array, speed: Array | None = None, pneumatic_stiffness: Array | None = None
) -> Array:
    """State (18, N) with the chambers in balance with weight and friction, at ambient temperature, valves closed.

    ``piston`` (2, N) in m, ``speed`` (2, N) in m/s (default rest), ``pneumatic_stiffness`` (2, N) in N/m after (9)
    (default 4600 and 2300). Pressures stay between atmosphere and supply, so a stiffness out of reach is approached.
    """
    lanes = lane_parameters.shape[1]
    state = np.zeros((at.STATES, lanes))
    state[[at.Y1, at.Y2]] = piston
    if speed is not None:
        state[[at.V1, at.V2]] = speed
    if pneumatic_stiffness is None:
        pneumatic_stiffness = np.repeat([[4600.0], [2300.0]], lanes, axis=1)
    balance(state, np.ascontiguousarray(pneumatic_stiffness, dtype=np.float64), lane_parameters)
    return state
