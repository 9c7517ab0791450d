"""Friction of one piston: LuGre for the plant, an elasto-plastic variant of it, and the paper's Coulomb and viscous law (4).

LuGre (Canudas de Wit et al., IEEE TAC 1995):
    dz/dt = v - s0 |v| z / G(v),  Ff = s0 z + s1 dz/dt + Fv v,  G(v) = Fc + (Fs - Fc) / (1 + (v/vs)^2)

Elasto-plastic (Dupont, Hayward, Armstrong and Altpeter, "Single state elastoplastic friction models", IEEE TAC 2002):
    dz/dt = v (1 - alpha q),  q = s0 z sgn(v) / G(v) = sgn(v) z / z_ss(v),  Ff as LuGre
Up to the break-away deflection, q <= z_ba / z_ss, and whenever z opposes v, alpha = 0: the bristle is a spring and nothing
creeps. Beyond, alpha rises to 1 at q = 1, so that steady sliding is LuGre's. LuGre itself is alpha = 1 throughout; it drifts
under any oscillating force. The authors' sine transition is replaced by the cubic 3 s^2 - 2 s^3, which needs only products. It
has the same ends, middle and symmetry, and is at most 0.010 away.

Pressure presses the lips of a piston's seals to the bore, so that of both levels
    Fc = (F0 + k (pP + pN)) (1 + a sgn(v)),  Fs = Fs/Fc Fc
with gauge pressures. Either way of motion has its own level (Zhu 2006, two of them); where sgn(v) jumps, |v|/G and the force of
(4) are zero, so that no law jumps.
"""

import math

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.step import STEP

RELAXATION_LIMIT = STEP.relaxation_limit
"""1/s. The bristle relaxes at s0 |v| / G; above this rate (about 1 m/s) it has long slid, and the rate is held so that the
explicit integrator stays stable. The steady deflection G/s0 is unchanged."""

ELASTO_PLASTIC_LIMIT = STEP.elasto_plastic_limit
"""1/s. The same for the elasto-plastic law: as alpha rises, its rate falls several times more steeply than LuGre's, so that
with too high a limit steps would stall short of the steady deflection instead of reaching it."""

SMALLEST_LEVEL = 1e-9
"""N. Keeps s0 |v| / G finite where the friction level is zero; the bristle then carries no force."""


@helper
def pressed_level(coulomb: float, growth: float, pressure_p: float, pressure_n: float, atmosphere: float) -> float:
    """F0 + k (pP + pN), N, of absolute pressures, for F0 = ``coulomb`` and k = ``growth``; never below zero."""
    return max(coulomb + growth * (pressure_p + pressure_n - 2.0 * atmosphere), 0.0)


@helper
def level_along(speed: float, level: float, asymmetry: float) -> float:
    """The level of the way in which a piston moves, N, from that without direction."""
    return level * (1.0 + (asymmetry if speed > 0.0 else -asymmetry))


@helper
def stribeck_level(speed: float, coulomb: float, static: float, stribeck_speed: float) -> float:
    """G(v), N."""
    square = stribeck_speed * stribeck_speed
    return coulomb + (static - coulomb) * square / (square + speed * speed)


@helper
def inverse_level(speed: float, coulomb: float, static: float, stribeck_speed: float) -> float:
    """1/G(v), 1/N, of a level of at least ``SMALLEST_LEVEL``."""
    square = stribeck_speed * stribeck_speed
    sum_of_squares = square + speed * speed
    level = coulomb * sum_of_squares + (static - coulomb) * square
    return sum_of_squares / max(level, SMALLEST_LEVEL * sum_of_squares)


@helper
def sliding_fraction(ratio: float, breakaway: float, steepness: float) -> float:
    """alpha, 0 to 1: 0 for q = ``ratio`` up to ``breakaway`` = z_ba/z_ss, 1 from q = 1; ``steepness`` is 1/(1 - breakaway)."""
    s = max(0.0, min(1.0, (ratio - breakaway) * steepness))
    return s * s * (3.0 - 2.0 * s)


@helper
def bristle_rate_by_law(
    speed: float, deflection: float, weakness: float, stiffness: float, lugre: bool, breakaway: float, steepness: float
) -> float:
    """dz/dt, m/s, for 1/G(v) = ``weakness``, of LuGre where ``lugre``, else of the elasto-plastic law."""
    scale = stiffness * (abs(speed) if lugre else 1.0) * weakness
    relaxation = scale * (1.0 if lugre else abs(speed))
    along = deflection if speed > 0.0 else -deflection
    fraction = 1.0 if lugre else sliding_fraction(scale * along, breakaway, steepness)
    limit = RELAXATION_LIMIT if lugre else ELASTO_PLASTIC_LIMIT
    return (speed - fraction * (relaxation * deflection)) * (limit / max(relaxation, limit))


@helper
def bristle_rate(speed: float, deflection: float, level: float, stiffness: float) -> float:
    """dz/dt of LuGre, m/s, for G(v) = ``level``."""
    return bristle_rate_by_law(speed, deflection, 1.0 / max(level, SMALLEST_LEVEL), stiffness, True, 0.0, 1.0)


@helper
def lugre_force(speed: float, deflection: float, rate: float, stiffness: float, damping: float, viscous: float) -> float:
    """Ff of LuGre and of the elasto-plastic law, N."""
    return stiffness * deflection + damping * rate + viscous * speed


@helper
def coulomb_force(speed: float, coulomb: float, viscous: float, sign_slope: float) -> float:
    """(4): Fc sign(v) + Fv v, N, with sign(v) = ``sign_slope`` v, s/m, near rest so that the equation can be integrated."""
    return coulomb * max(-1.0, min(1.0, sign_slope * speed)) + viscous * speed


@helper
def steady_deflection(speed: float, level: float, stiffness: float) -> float:
    """Bristle deflection of a piston that has moved at ``speed`` for long: sign(v) G/s0, m; zero at rest."""
    return math.copysign(level / stiffness, speed) if speed != 0.0 else 0.0
