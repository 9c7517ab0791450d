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

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.seals import friction
from birthsim_env.physics.step import STEP

ELEMENTS = 4
MOVING, ROWS = 2 * ELEMENTS, 4 * ELEMENTS
"""Rows of both pistons: deflections z_i of the elements, m, which have rates, and then the ways in which they slip."""
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


@helper
def piston_friction(x: Array, p: Array, dx: Array, i: int, cylinder: int, bristles: int) -> tuple[float, float]:
    """``dynamics.piston_friction`` with elements, whose rates it writes; their rows of ``x`` begin at ``bristles``."""
    v, s0, first = x[at.V1 + 2 * cylinder, i], p[at.S0, i], bristles + ELEMENTS * cylinder
    weakness, deflection, rate = dynamics.weakness_of(x, p, i, cylinder), 0.0, 0.0
    for element in range(ELEMENTS):
        z, most = x[first + element, i], reach(element, weakness, s0)
        slips, held = x[first + MOVING + element, i] * v > 0.0, held_in(v, z, most)
        sliding = slip_rate(v, z, most, p[at.ATTRACTION, i] * weakness)
        dx[first + element, i] = sliding if slips else v
        deflection += STIFFNESS[element] * (z if slips else held)
        rate += STIFFNESS[element] * (sliding if slips else v if held == z else 0.0)
    viscous = p[at.FV1, i] if cylinder == 0 else p[at.FV2, i]
    return friction.lugre_force(v, deflection, rate, s0, p[at.S1, i], viscous), rate


@helper
def switch_elements(before: Array, x: Array, p: Array, bristles: int, step: float, n: int) -> None:
    """After a step from ``before`` to ``x``: which elements slip, how far those are bent that begin to, and the mean of all."""
    for i in range(n):
        if p[at.GMS, i] > 0.5:
            for cylinder in range(2):
                v, s0, mean = x[at.V1 + 2 * cylinder, i], p[at.S0, i], 0.0
                sign, first = (1.0 if v > 0.0 else -1.0), bristles + ELEMENTS * cylinder
                weakness, past = dynamics.weakness_of(x, p, i, cylinder), dynamics.weakness_of(before, p, i, cylinder)
                for element in range(ELEMENTS):
                    row, most = first + element, reach(element, weakness, s0)
                    slips, along = x[row + MOVING, i] * v > 0.0, sign * x[row, i]
                    if not slips and along >= most:
                        earlier, attraction = reach(element, past, s0), p[at.ATTRACTION, i] * weakness
                        x[row, i] = sign * caught(sign * before[row, i], along, earlier, most, attraction, step)
                        slips = True
                    x[row + MOVING, i] = sign if slips else 0.0
                    mean += STIFFNESS[element] * x[row, i]
                x[at.Z1 + cylinder, i] = mean


@helper
def rest(state: Array, parameters: Array, rows: Array) -> None:
    """Writes the ``rows`` (ROWS, N) with which states (18, N) begin: bent as far as their bristles, by loading from rest."""
    for cylinder in range(2):
        for i in range(state.shape[1]):
            v, s0, mean = state[at.V1 + 2 * cylinder, i], parameters[at.S0, i], state[at.Z1 + cylinder, i]
            weakness, way = dynamics.weakness_of(state, parameters, i, cylinder), (1.0 if v > 0.0 else -1.0)
            for element in range(ELEMENTS):
                row = ELEMENTS * cylinder + element
                rows[row, i] = loaded(element, mean, weakness, s0)
                slips = v != 0.0 and way * rows[row, i] >= reach(element, weakness, s0)
                rows[row + MOVING, i] = way if slips else 0.0
