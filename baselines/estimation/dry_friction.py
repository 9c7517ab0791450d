"""The Coulomb friction that is believed of a piston: of the rig as described, at the pressures of its chambers as measured."""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.seals import friction


@helper
def level_at(cylinder: int, pressures: Array, i: int, p: Rig) -> float:
    """F0 + k (pP + pN), N, of piston 0 or 1 of lane ``i`` at absolute ``pressures`` (4, N) of chambers P1, N1, P2, N2."""
    coulomb, growth = (p.fc1, p.fp1) if cylinder == 0 else (p.fc2, p.fp2)
    pressure_p, pressure_n = pressures[2 * cylinder, i], pressures[2 * cylinder + 1, i]
    return friction.pressed_level(coulomb, growth, pressure_p, pressure_n, p.atmosphere)


@helper
def level_along(cylinder: int, speed: float, level: float, p: Rig) -> float:
    """The ``level`` of the way in which a piston moves, N."""
    return friction.level_along(speed, level, p.asymmetry1 if cylinder == 0 else p.asymmetry2)


@helper
def level_moving(cylinder: int, speed: float, pressures: Array, i: int, p: Rig) -> float:
    """Fc, N, of piston 0 or 1 of lane ``i`` that moves at ``speed`` under ``pressures`` (4, N)."""
    return level_along(cylinder, speed, level_at(cylinder, pressures, i, p), p)
