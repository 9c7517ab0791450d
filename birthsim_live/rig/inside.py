"""What goes on inside the cylinders: friction of the pistons and the air that flows into the chambers."""

from birthsim_env.physics import dynamics, friction
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

ROWS = 6


@helper
def piston_friction(x: Array, p: Array, i: int, speed: int, bristle: int, coulomb: int, static: int, viscous: int) -> float:
    """Friction on the rod, N, as in ``dynamics.right_hand_side``: along the motion it is positive and holds it back."""
    v, z, s0 = x[speed, i], x[bristle, i], p[at.BRISTLE_S0, i]
    if p[at.LUGRE, i] + p[at.ELASTO_PLASTIC, i] <= 0.5:
        return friction.coulomb_force(v, p[coulomb, i], p[viscous, i], p[at.SIGN_SLOPE, i])
    weakness = friction.inverse_level(v, p[coulomb, i], p[static, i], p[at.STRIBECK, i])
    rate = friction.bristle_rate_by_law(v, z, weakness, s0, p[at.LUGRE, i] > 0.5, p[at.BREAKAWAY, i], p[at.STEEPNESS, i])
    return friction.lugre_force(v, z, rate, s0, p[at.BRISTLE_S1, i], p[viscous, i])


@helper
def look_inside(x: Array, p: Array, rows: Array) -> None:
    """Writes friction of pistons 1 and 2, N, and net flows into chambers P1, N1, P2, N2, kg/s, (ROWS, N).

    State ``x`` (18, N), parameters ``p`` (PARAMETERS, N).
    """
    for i in range(x.shape[1]):
        rows[0, i] = piston_friction(x, p, i, at.V1, at.Z1, at.FC1, at.FS1, at.FV1)
        rows[1, i] = piston_friction(x, p, i, at.V2, at.Z2, at.FC2, at.FS2, at.FV2)
        for k in range(4):
            supplied, exhausted = dynamics.flows_of(x, p, i, at.PRESSURES[k], at.TEMPERATURES[k], at.SPOOLS[k])
            rows[2 + k, i] = supplied - exhausted
