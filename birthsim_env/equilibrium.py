"""States to start from: pistons at given positions and speeds, chambers balanced at a pneumatic stiffness."""

from __future__ import annotations

import math

import numpy as np

from birthsim_env import friction, geometry
from birthsim_env.compilation import kernel
from birthsim_env.lanes import (  # fmt: skip
    AREA_N1, AREA_N2, AREA_P1, AREA_P2, ATMOSPHERE, BRISTLE_S0, COS_GAMMA3, D_PRODUCT, D_SQUARES, FC1, FC2, FS1, FS2, FV1, FV2,
    GRAVITY, HALF_L1, HALF_L2, INDEX, K1, K2, LUGRE, MASS, PN1, PN2, PP1, PP2, SIN_GAMMA3, SPOOLS, STATES, STRIBECK, SUPPLY,
    TEMPERATURE, TEMPERATURES, V1, V2, Y1, Y2, Z1, Z2, Array,
)


@kernel
def _balance(state: Array, stiffness: Array, p: Array) -> None:
    """Fills pressures, temperatures and bristles of a state whose positions and speeds are set."""
    for i in range(state.shape[1]):
        r4, r2 = state[Y1, i] + p[K1, i], state[Y2, i] + p[K2, i]
        w = r4 * r4 - p[D_SQUARES, i]
        root = math.sqrt(geometry.s_squared(w, p[D_PRODUCT, i]))
        kappa = geometry.amplification(r2, r4, root)
        sine = geometry.sin_theta1(w, root, p[D_PRODUCT, i], p[SIN_GAMMA3, i], p[COS_GAMMA3, i])
        cosine = geometry.cos_theta1(w, root, p[D_PRODUCT, i], p[SIN_GAMMA3, i], p[COS_GAMMA3, i])
        weight1 = p[MASS, i] * kappa * p[GRAVITY, i] * sine
        weight2 = p[MASS, i] * p[GRAVITY, i] * cosine
        for cylinder in range(2):
            v, z, pp, pn = (V1, Z1, PP1, PN1) if cylinder == 0 else (V2, Z2, PP2, PN2)
            fc, fs, fv = (FC1, FS1, FV1) if cylinder == 0 else (FC2, FS2, FV2)
            ap, an = (p[AREA_P1, i], p[AREA_N1, i]) if cylinder == 0 else (p[AREA_P2, i], p[AREA_N2, i])
            half = p[HALF_L1, i] if cylinder == 0 else p[HALF_L2, i]
            y = state[Y1, i] if cylinder == 0 else state[Y2, i]
            speed = state[v, i]
            level = friction.stribeck_level(speed, p[fc, i], p[fs, i], p[STRIBECK, i])
            bristle = friction.steady_deflection(speed, level, p[BRISTLE_S0, i]) if p[LUGRE, i] > 0.5 else 0.0
            sliding = level if p[LUGRE, i] > 0.5 else p[fc, i]
            drag = (math.copysign(sliding, speed) if speed != 0.0 else 0.0) + p[fv, i] * speed
            weight = weight1 if cylinder == 0 else weight2
            force = p[ATMOSPHERE, i] * (ap - an) + drag - weight
            # F = a - b and K/k = a/Lp + b/Ln, (3) and (9), are linear in a = Pp Sp and b = Pn Sn.
            length_p, length_n = half + y, half - y
            a = (stiffness[cylinder, i] / p[INDEX, i] + force / length_n) / (1.0 / length_p + 1.0 / length_n)
            low, high = p[ATMOSPHERE, i], p[SUPPLY, i]
            a = max(max(low * ap, low * an + force), min(min(high * ap, high * an + force), a))
            state[z, i] = bristle
            state[pp, i] = a / ap
            state[pn, i] = (a - force) / an
        for row in TEMPERATURES:
            state[row, i] = p[TEMPERATURE, i]
        for row in SPOOLS:
            state[row, i] = 0.0


def balanced_state(
    lane_parameters: Array, piston: Array, speed: Array | None = None, pneumatic_stiffness: Array | None = None
) -> Array:
    """State (18, N) with the chambers in balance with weight and friction, at ambient temperature, valves closed.

    ``piston`` (2, N) in m, ``speed`` (2, N) in m/s (default rest), ``pneumatic_stiffness`` (2, N) in N/m after (9)
    (default 4600 and 2300). Pressures stay between atmosphere and supply, so a stiffness out of reach is approached.
    """
    lanes = lane_parameters.shape[1]
    state = np.zeros((STATES, lanes))
    state[[Y1, Y2]] = piston
    if speed is not None:
        state[[V1, V2]] = speed
    if pneumatic_stiffness is None:
        pneumatic_stiffness = np.repeat([[4600.0], [2300.0]], lanes, axis=1)
    _balance(state, np.ascontiguousarray(pneumatic_stiffness, dtype=np.float64), lane_parameters)
    return state
