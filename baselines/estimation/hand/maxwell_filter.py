"""``bristle_filter`` of a piston whose friction is generalised Maxwell slip: bristles side by side that stick or slip.

    z_i' = v until |z_i| reaches D_i(v) = d_i G(v)/s0, where it stays;   z = sum c_i z_i
with the elements of ``maxwell_slip``, which follow G(v) at once. The filter knows their mean z. What a measurement
corrects of z is shared by the elements that stick, whose part of the stiffness is ``grip``; what an element that begins to slip
was off is forgotten, so that the variance of z falls with the grip.
"""

from baselines.estimation.hand import bristle_filter
from baselines.estimation.hand.bristle_filter import Bristled, Law
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import rows
from birthsim_env.physics.seals.maxwell_slip import ELEMENTS, REACH, STIFFNESS

LEAST_GRIP = 1e-3
"""Less than any element has of the stiffness. Where none sticks nothing is divided by the grip, nor is a slope infinite."""


class Elements(Bristled):
    """``Bristled`` with its elements."""

    element = rows(2 * ELEMENTS, "m", "deflections of the elements of piston 1, then of piston 2")
    grip = rows("g1 g2", "1", "part of the stiffness that sticks; 1 where there are no elements")


@helper
def begin(b: Elements, k: int, i: int, law: Law, p: Rig) -> None:
    """Bends the elements of piston ``k`` of lane ``i`` as loading from rest has bent their mean, as far as they reach."""
    slack, z = bristle_filter.slack_at(k, b.bristle[k, i], b.level[k, i], law, p), b.bristle[k, i]
    for e in range(ELEMENTS):
        most = REACH[e] * slack
        b.element[ELEMENTS * k + e, i] = max(-most, min(most, z))
    b.grip[k, i] = 1.0


@helper
def predict(
    b: Elements,
    k: int,
    i: int,
    load: float,
    own: float,
    answer: float,
    push_noise: float,
    boost: float,
    law: Law,
    p: Rig,
    period: float,
) -> None:
    """``bristle_filter.predict`` with elements."""
    viscous, v, before = (p.fv1 if k == 0 else p.fv2), b.speed[k, i], b.grip[k, i]
    mean = 0.0
    for e in range(ELEMENTS):
        mean += STIFFNESS[e] * b.element[ELEMENTS * k + e, i]
    shift = (b.bristle[k, i] - mean) / max(before, LEAST_GRIP) if before > 0.0 else 0.0
    slack, z = bristle_filter.slack_at(k, v, b.level[k, i], law, p), 0.0
    for e in range(ELEMENTS):
        row, most = ELEMENTS * k + e, REACH[e] * slack
        old = b.element[row, i]
        sticks = abs(old) < most or old * v <= 0.0
        b.element[row, i] = max(-most, min(most, old + shift if sticks else old))
        z += STIFFNESS[e] * b.element[row, i]
    rate = own + answer * (load + b.push[k, i] - viscous * v - law.stiffness * z - law.damping * before * v)
    step = period * answer
    av, az, af = 1.0 - step * (viscous + law.damping * before), -step * law.stiffness, step
    v += period * rate
    slack, z, grip = bristle_filter.slack_at(k, v, b.level[k, i], law, p), 0.0, 0.0
    for e in range(ELEMENTS):
        row, most = ELEMENTS * k + e, REACH[e] * slack
        moved = b.element[row, i] + period * v
        held = max(-most, min(most, moved))
        b.element[row, i] = held
        z += STIFFNESS[e] * held
        grip += STIFFNESS[e] if held == moved else 0.0
    kept = min(1.0, grip / max(before, LEAST_GRIP)) if before > 0.0 else 1.0
    bend = period * grip
    b.grip[k, i] = grip
    b.position[k, i] += period * v
    b.speed[k, i], b.bristle[k, i] = v, z
    bristle_filter.spread(b, k, i, (av, az, af), (bend * av, kept + bend * az, bend * af), push_noise, boost, period)
