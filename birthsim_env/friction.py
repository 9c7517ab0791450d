"""Friction of one piston: LuGre for the plant, and the paper's Coulomb and viscous law (4).

LuGre (Canudas de Wit et al., IEEE TAC 1995), design section 2:
    dz/dt = v - s0 |v| z / G(v),  Ff = s0 z + s1 dz/dt + Fv v,  G(v) = Fc + (Fs - Fc) / (1 + (v/vs)^2)
"""

from __future__ import annotations

import math

from birthsim_env.compilation import helper

RELAXATION_LIMIT = 8000.0
"""1/s. The bristle relaxes at s0 |v| / G; above this rate (about 2 m/s) it has long slid, and the rate is held so that the
explicit integrator stays stable. The steady deflection G/s0 is unchanged."""

SMALLEST_LEVEL = 1e-9
"""N. Keeps s0 |v| / G finite where the friction level is zero; the bristle then carries no force."""


@helper
def stribeck_level(speed: float, coulomb: float, static: float, stribeck_speed: float) -> float:
    """G(v), N."""
    ratio = speed / stribeck_speed
    return coulomb + (static - coulomb) / (1.0 + ratio * ratio)


@helper
def bristle_rate(speed: float, deflection: float, level: float, stiffness: float) -> float:
    """dz/dt of LuGre, m/s, for G(v) = ``level``."""
    relaxation = stiffness * abs(speed) / max(level, SMALLEST_LEVEL)
    return (speed - relaxation * deflection) * (RELAXATION_LIMIT / max(relaxation, RELAXATION_LIMIT))


@helper
def lugre_force(speed: float, deflection: float, rate: float, stiffness: float, damping: float, viscous: float) -> float:
    """Ff of LuGre, N."""
    return stiffness * deflection + damping * rate + viscous * speed


@helper
def coulomb_force(speed: float, coulomb: float, viscous: float, sign_speed: float) -> float:
    """(4): Fc sign(v) + Fv v, N, with sign(v) linear below ``sign_speed`` so that the equation can be integrated."""
    return coulomb * max(-1.0, min(1.0, speed / sign_speed)) + viscous * speed


@helper
def steady_deflection(speed: float, level: float, stiffness: float) -> float:
    """Bristle deflection of a piston that has moved at ``speed`` for long: sign(v) G/s0, m; zero at rest."""
    return math.copysign(level / stiffness, speed) if speed != 0.0 else 0.0
