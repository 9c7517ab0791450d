"""What the pistons meet that the rig's description does not explain: now, and when they last moved either way.

An observer finds the force that accelerates each piston unexplained; dry friction is a part of it, and jumps where the piston
turns. What was met when the piston last moved out and in tells weight and friction apart, and friction before it jumps.
"""

from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.linkage import geometry

BANDWIDTH = 60.0
"""1/s, of the observer where speeds are measured; assumed."""

MOVING = 0.005
"""m/s; assumed: a faster piston slides."""

AVERAGE = 0.2
"""s of sliding over which what was met is averaged; assumed."""


class Forces(Rows):
    """Unexplained force on the pistons."""

    now = rows("1 2", "N", "now")
    out = rows("1 2", "N", "when last moving out")
    inwards = rows("1 2", "N", "when last moving in")


class Moved(Rows):
    """Which ways pistons have moved."""

    out = rows("1 2", "1", "1 where a piston has moved out")
    inwards = rows("1 2", "1", "1 where it has moved in")


@helper
def _average(last: Array, moved: Array, cylinder: int, i: int, moves: bool, force: float, fraction: float) -> None:
    """Averages what was met one way, ``last`` (2, N), while the piston ``moves`` that way."""
    if moves:
        last[cylinder, i] += (fraction if moved[cylinder, i] > 0.0 else 1.0) * (force - last[cylinder, i])
        moved[cylinder, i] = 1.0
    elif moved[cylinder, i] == 0.0:
        last[cylinder, i] = force


@helper
def remember(joints: Joints, disturbance: Array, p: Rig, period: float, moved: Moved, forces: Forces, n: int) -> None:
    """Brings the ``forces`` of n lanes up to a ``disturbance`` (2, n), m/s2."""
    fraction = 1.0 - exact.exp(-period / AVERAGE)
    for i in range(n):
        y1, y2 = joints.position[0, i], joints.position[1, i]
        _, _, _, _, _, kappa, _, _ = geometry.pose(y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3)
        for cylinder in range(2):
            mass = p.mass * kappa * kappa if cylinder == 0 else p.mass
            force, speed = mass * disturbance[cylinder, i], joints.speed[cylinder, i]
            forces.now[cylinder, i] = force
            _average(forces.out, moved.out, cylinder, i, speed > MOVING, force, fraction)
            _average(forces.inwards, moved.inwards, cylinder, i, speed < -MOVING, force, fraction)
