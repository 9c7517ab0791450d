"""Generalised Maxwell slip: bristles side by side, each of which sticks or slips (Al-Bender, Lampaert and Swevers 2005).

Of element i, with its share c_i of the stiffness s0, its deflection z_i, and the level G(v) of ``friction`` (IEEE TAC 50):
    sticks:  dz_i/dt = v,                             until |z_i| reaches D_i(v) = d_i G(v)/s0
    slips:   dz_i/dt = sgn(v) C/G(v) (D_i(v) - |z_i|),  until v passes zero
    Ff = sum c_i (s0 z_i + s1 dz_i/dt) + Fv v
where sum c_i = sum c_i d_i = 1, so that s0 is the stiffness at a reversal and G(v) the friction of steady sliding. Unlike
LuGre it does not drift, and it remembers where it turned round: a closed loop of displacements closes in the force, and a
branch that begins at a reversal is the first loading twice as large (Masing 1926). While an element slips, C lets friction lag
behind G(v). A slipping element deflects no faster than the piston moves, which the authors leave open; friction then takes
energy at all times.

An element that slips goes on slipping where G(v) grows faster than it follows, so it is a state that it slips: the way in which
it does, 1 or -1, and 0 while it sticks. It changes between integration steps alone. Within a step one that slipped sticks where
v has passed zero, and one that stuck holds no more than D_i; where it began to slip is found at its end (``caught``).
"""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.step import STEP

ELEMENTS = 4
STIFFNESS, REACH = (0.4, 0.3, 0.2, 0.1), (0.2, 0.8, 1.6, 3.6)
"""c_i and d_i: with as few as four elements the first loading is within 3 % of G(v) of LuGre's, 1 - exp(-s0 y/G); 3 elements
leave as much, but one corner less to remember. Assumed."""


@helper
def reach(element: int, weakness: float, stiffness: float) -> float:
    """D_i, m, for 1/G(v) = ``weakness``, 1/N."""
    return REACH[element] / (stiffness * weakness)


@helper
def slip_rate(speed: float, deflection: float, most: float, attraction: float) -> float:
    """dz_i/dt of an element that slips, m/s; ``attraction`` is C/G(v), 1/s, held at what integration steps follow."""
    along, size = (deflection, speed) if speed > 0.0 else (-deflection, -speed)
    rate = min(size, min(attraction, STEP.relaxation_limit) * (most - along))
    return rate if speed > 0.0 else -rate


@helper
def held_in(speed: float, deflection: float, most: float) -> float:
    """Deflection, m, of an element that sticks, as far as it holds: within a step it may come past ``most`` = D_i."""
    return min(most, deflection) if speed > 0.0 else max(-most, deflection)


@helper
def caught(before: float, after: float, most_before: float, most: float, attraction: float, step: float) -> float:
    """Deflection along the motion, m, of an element that began to slip in a step of ``step`` s: from ``before`` and, as if it
    had stuck, ``after`` the step, while its reach went from ``most_before`` to ``most``.

    Both are straight lines within the step; where they cross it slips, and for the rest of the step it gives way.
    """
    left, beyond = max(most_before - before, 0.0), after - most
    share = left / max(left + beyond, 1e-300)
    reached = most_before + share * (most - most_before)
    return reached + min(0.5 * (1.0 - share) * step * min(attraction, STEP.relaxation_limit), 1.0) * (most - reached)


@helper
def loaded(element: int, mean: float, weakness: float, stiffness: float) -> float:
    """Deflection of an element, m, where loading from rest has brought them to sum c_i z_i = ``mean``, m."""
    size, moved, rigid, before = abs(mean), 0.0, 1.0, 0.0
    for other in range(ELEMENTS):
        # Until this element slips, all that do not slip yet, of the share ``rigid``, deflect alike.
        span = min(reach(other, weakness, stiffness) - before, max(size, 0.0) / rigid)
        moved, size, before = moved + span, size - rigid * span, before + span
        rigid = max(rigid - STIFFNESS[other], STIFFNESS[ELEMENTS - 1])
    found = min(moved, reach(element, weakness, stiffness))
    return found if mean > 0.0 else -found
