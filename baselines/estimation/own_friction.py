"""Friction of each piston along its own motion, for an observer that sees positions late and rarely.

Between samples the observer knows the speed only as well as the forces. Friction along the reference turns when the reference
turns, that of the piston when the piston turns. So the observer is told LuGre friction on the speed that it estimates,
    z' = v - s0 |v| z/G(v),   friction = -s0 z,
with G the believed level times what ``friction_level`` has learned. While a piston rests, friction is what holds it: what the
observer then adds to its disturbance d moves into z, as far as static friction goes. Once the piston slides the other way, z is
on its other side within a millimetre; d would go on standing for a force that is gone.

The law wants friction as it will be, which is that along the reference, and as it is where the two differ for long:
    told = reference + gap,   gap' = q (friction - reference - gap),   and of a resting piston gap = friction - reference.
"""

from __future__ import annotations

from baselines.estimation.observers import ESTIMATE, REST
from birthsim_env.physics import friction as lugre
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array

ROWS = 4
"""Deflections z of both pistons' bristles, m, and their gaps, N."""
BRISTLE, GAP = 0, 2

QUICKNESS = 50.0
"""q, 1/s; found by trial."""


@kernel
def rub(
    memory: Array, pistons: Array, levels: Array, p: Array, period: float, fresh: Array, friction: Array, before: Array
) -> None:  # fmt: skip
    """Carries z on by one period and writes ``friction`` (2, N), N, along the pistons; ``before`` (2, N) gets d, m/s2.

    ``pistons`` is the memory of ``observers``, ``levels`` (2, N) what friction is of that believed.
    """
    for i in range(fresh.shape[0]):
        for k in range(2):
            coulomb, static = (p[at.FC1], p[at.FS1]) if k == 0 else (p[at.FC2], p[at.FS2])
            speed, z = pistons[ESTIMATE + 2 + k, i], 0.0 if fresh[i] > 0.0 else memory[BRISTLE + k, i]
            level = levels[k, i] * lugre.stribeck_level(speed, coulomb, static, p[at.STRIBECK])
            # Exact while the speed is constant: z tends to +-G/s0.
            most = max(level, lugre.SMALLEST_LEVEL) / p[at.BRISTLE_S0]
            slid = most if speed > 0.0 else -most
            z = slid + (z - slid) * exact.exp(-abs(speed) * period / most)
            memory[BRISTLE + k, i], before[k, i] = z, pistons[ESTIMATE + 4 + k, i]
            friction[k, i] = -p[at.BRISTLE_S0] * z


@kernel
def hold(memory: Array, pistons: Array, levels: Array, p: Array, before: Array, friction: Array) -> None:
    """Moves what d of a resting piston has grown by since ``before`` (2, N), m/s2, into z and ``friction`` (2, N), N."""
    for i in range(before.shape[1]):
        kappa = geometry.pose(
            pistons[0, i], pistons[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3],
            p[at.COS_GAMMA3],
        )[5]  # fmt: skip
        for k in range(2):
            mass = p[at.MASS] * kappa * kappa if k == 0 else p[at.MASS]
            most = levels[k, i] * (p[at.FS1] if k == 0 else p[at.FS2])
            grown = mass * pistons[REST + k, i] * (pistons[ESTIMATE + 4 + k, i] - before[k, i])
            carried = max(-most, min(most, friction[k, i] + grown))
            pistons[ESTIMATE + 4 + k, i] -= (carried - friction[k, i]) / mass
            memory[BRISTLE + k, i], friction[k, i] = -carried / p[at.BRISTLE_S0], carried


@kernel
def tell(memory: Array, rest: Array, reference: Array, period: float, fresh: Array, friction: Array) -> None:
    """Turns ``friction`` (2, N), N, into what the law is told; ``reference`` (2, N), N, is that along the reference and
    ``rest`` (2, N) how far each piston rests."""
    for i in range(fresh.shape[0]):
        for k in range(2):
            gap = 0.0 if fresh[i] > 0.0 else memory[GAP + k, i]
            gap += max(rest[k, i], QUICKNESS * period) * (friction[k, i] - reference[k, i] - gap)
            memory[GAP + k, i], friction[k, i] = gap, reference[k, i] + gap
