"""Friction of each piston, identified while it slides: least mean squares on what the force balance leaves.

What the known forces leave, R, is friction that opposes sliding and a part that knows no direction: an error of the mass, of
the pressures or of the force sensor. With u in [-1, 1], friction along the reference over that believed,
    R = -level Fc u - offset,   e = R + level Fc u + offset,   level' = -a e u / Fc,   offset' = -a e
while the piston slides as u says. Only sliding in both directions separates the two. R is the feedforward that was given plus
what the observer found besides, so that it does not depend on what has been learned.
"""

from baselines.estimation import dry_friction
from baselines.estimation.rows import AssumedParameters
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, rows

LAG = 0.02
"""s; assumed: u is low-passed as the observer delays R."""

SLIDING = 0.8
"""assumed: low-passed |u| beyond which a piston has been sliding one way for long enough, some 30 ms."""

SPEED = 3e-3
"""m/s; assumed: a slower piston may be stuck, and then its friction is anything."""

LEAST, MOST = 0.2, 3.0
"""Bounds of the level; assumed."""


class Friction(Rows):
    """What is learned of both pistons; the level is 1 at a new start."""

    level = rows("level1 level2", "1", "friction in units of that believed")
    offset = rows("offset1 offset2", "N", "unexplained force that knows no direction")
    sliding = rows("u1 u2", "1", "low-passed friction along the reference, in units of Fc")


@helper
def learn(
    friction: Friction,
    drag: Array,
    joints: Joints,
    pressures: Array,
    unexplained: Array,
    rate: float,
    assumed: AssumedParameters,
    fresh: Array,
) -> None:
    """Carries ``friction`` on by one period.

    ``drag`` (2, N), N, is the believed friction along the reference, with chambers at ``pressures`` (4, N), Pa; ``unexplained``
    (2, N), N, is R; ``rate``, a in 1/s.
    """
    p, period = assumed.rig, assumed.period
    for i in range(fresh.shape[0]):
        for cylinder in range(2):
            coulomb = dry_friction.level_moving(cylinder, drag[cylinder, i], pressures, i, p)
            if fresh[i] > 0.0:
                friction.level[cylinder, i], friction.offset[cylinder, i], friction.sliding[cylinder, i] = 1.0, 0.0, 0.0
            if coulomb <= 0.0:
                continue
            u = max(-1.0, min(1.0, drag[cylinder, i] / coulomb))
            friction.sliding[cylinder, i] += period / (LAG + period) * (u - friction.sliding[cylinder, i])
            slides = friction.sliding[cylinder, i]
            if abs(slides) > SLIDING and slides * joints.speed[cylinder, i] > SPEED * abs(slides):
                level, offset = friction.level[cylinder, i], friction.offset[cylinder, i]
                error = unexplained[cylinder, i] + level * coulomb * slides + offset
                friction.level[cylinder, i] = max(LEAST, min(MOST, level - period * rate * error * slides / coulomb))
                friction.offset[cylinder, i] = offset - period * rate * error
