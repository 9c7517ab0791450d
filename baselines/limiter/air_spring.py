"""The rig as an air spring about its target: what the valves are led to where a law may not act.

Valves that shut lock in the pressures of that moment. These balance neither weight nor hand, and the rig moves to where they
do, which gives a hand 0.1 J and more. So the valves give each chamber the air with which the rig alone would rest at its
target. A chamber's air is judged by pressure times length, at the time at which the position was taken. The product does not
depend on how the rig moves, so the valves do not excite what they hold. A rig of constant air is a spring that friction damps.

The forces of the chambers that balance the weight are those of now and the hand's share, averaged over ``MEMORY``: over an
oscillation the acceleration averages to nothing.
"""

import math

from baselines.valve_inverse import driving_flows, valve_of
from birthsim_env.loop.rows import Signals
from birthsim_env.loop.signals import InPlane, Joints
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.pneumatics import valves

RETURN = 0.02
"""s, time constant with which the air comes back; assumed, some times the valves' own."""

MEMORY = 1.0
"""s, assumed: longer than a period of the softest oscillation, shorter than a rig's load changes."""


@helper
def passive_openings(
    forces: Array,
    rate: float,
    pressures: Array,
    hand: InPlane,
    here: Joints,
    there: Joints,
    seen: Signals,
    p: Rig,
    opening: Array,
    i: int,
) -> None:
    """Writes the spool openings (4, N) of lane ``i`` at the signals of now.

    ``forces`` (4, N), N, of the chambers that balance the weight, NaN before the first, go on by the fraction ``rate``. The
    ``pressures`` (4, N), Pa, and the ``hand``'s force, N, are those when the position was taken; the pistons are
    ``here``, and belong ``there``.
    """
    y1, y2 = here.position[0, i], here.position[1, i]
    _, _, _, _, _, kappa, sine, cosine = geometry.pose(y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3)
    gas_t = RETURN * p.gas * p.temperature
    for chamber in range(4):
        first, outward = chamber < 2, 1.0 if chamber % 2 == 0 else -1.0
        half = p.half_l1 if first else p.half_l2
        y, wanted = here.position[chamber // 2, i], there.position[chamber // 2, i]
        area_p, area_n = (p.area_p1, p.area_n1) if first else (p.area_p2, p.area_n2)
        area, other = (area_p, area_n) if outward > 0.0 else (area_n, area_p)
        along = (
            mechanics.user_force1(hand.x[i], hand.y[i], kappa, sine, cosine)
            if first
            else mechanics.user_force2(hand.x[i], hand.y[i], sine, cosine)
        )
        length, stroke = half + p.dead_volume / area + outward * y, 2.0 * half + p.dead_volume / area + p.dead_volume / other
        force = pressures[chamber, i] * area
        balanced = force + outward * along * length / stroke
        if math.isnan(forces[chamber, i]):
            forces[chamber, i] = balanced
        forces[chamber, i] += rate * (balanced - forces[chamber, i])
        flow = (forces[chamber, i] * (half + p.dead_volume / area + outward * wanted) - force * length) / gas_t
        fill, drain = driving_flows(seen.pressure[chamber, i], p)
        opening[chamber, i] = valves.opening_for_flow(flow, fill, drain, valve_of(chamber, p))
