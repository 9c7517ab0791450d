"""Backstepping gains for a closed-loop stiffness, and for a stiffness with a damping.

The errors z1' = z2 - c1 z1, z2' = g z3 - z1 - c2 z2, z3' = -z2/g - c3 z3 of a piston of apparent mass m_e = 1/g and viscous
friction Fv resist a hand with the impedance (force over displacement; phi = Fv/m_e)
    Z(s) = m_e (s^3 + a2 s^2 + a1 s + a0) / (s + a2 - phi)
    a2 = c1 + c2 + c3,  a1 = c1 c2 + c1 c3 + c2 c3 + 2,  a0 = c1 + c3 + c1 c2 c3
and slow pushes, to the first order in s, with K + B s:
    K = m_e a0 / (a2 - phi),  B = (m_e a1 - K) / (a2 - phi).
So K, B and the sum a2 fix a1 and a0, and with them the gains: c2 is a root of c2^3 - a2 c2^2 + (a1 - 3) c2 + a2 - a0 = 0, c1
and c3 those of a quadratic. All gains of one a2, a1, a0 are the same law, since a feedback of y, v and F is given by its poles.

Equal gains c turn K into the cubic m_e c^3 + (2 m_e - 3 K) c + K Fv/m_e = 0; its largest root is taken. They are the least
damped: no positive gains of that sum or a larger one render a damping ratio B / (2 sqrt(K m_e)) more than 0.1 % below theirs,
which is 0.77 without viscous friction. More damping takes a larger sum. Within 0.1 % the smallest one that will do has
c1 = c3 > c2, the largest root of a quartic, and it exists for any damping above the least.
"""

import math
from itertools import pairwise

import numpy as np

from birthsim_env.physics.compiled.compilation import helper

ITERATIONS = 8
"""Newton from above on a convex function: quadratic, at rounding error after six unless beside the least stiffness."""

DAMPED_ITERATIONS = 20
"""As above; beside the least damping, where two roots meet, every step halves the distance that is left."""

TOLERANCE = 1e-6
"""Largest relative error of the damping that outer and inner gain may leave: more says that there are no such gains."""


@helper
def equal_gain(stiffness: float, apparent_mass: float, viscous: float) -> float:
    """The gain c1 = c2 = c3 (1/s) that renders ``stiffness`` (N/m); the nearest possible where none does.

    ``apparent_mass`` is m_e (kg): m for cylinder 2, m kappa^2 for cylinder 1; ``viscous`` is Fv (N s/m).
    """
    linear = 2.0 * apparent_mass - 3.0 * stiffness
    constant = stiffness * viscous / apparent_mass
    # Newton's slope is positive above the cubic's minimum. The largest root of a feasible setpoint lies above Fv/(2 m_e),
    # which renders the least stiffness within 1 % (for Fv/m_e > 7 1/s); below Fv/(3 m_e) the piston would not hold at all.
    minimum = 1.001 * math.sqrt(max(-linear / (3.0 * apparent_mass), 1e-6))
    lowest = max(minimum, 0.5 * viscous / apparent_mass)
    c = math.sqrt(3.0 * stiffness / apparent_mass)
    for _ in range(ITERATIONS):
        value = (apparent_mass * c * c + linear) * c + constant
        c = max(lowest, c - value / (3.0 * apparent_mass * c * c + linear))
    return c


@helper
def equal_gain_misses(stiffness: float, apparent_mass: float, viscous: float) -> float:
    """1 where the cubic of ``equal_gain`` has no positive root, 0 where it has: the sign of its discriminant.

    A stiffness that is not a number passes: it comes from a state that is none.
    """
    k, drag = stiffness / apparent_mass, viscous / apparent_mass
    p = 3.0 * k - 2.0
    return 1.0 if (p <= 0.0 or 4.0 * p * p * p < 27.0 * k * k * drag * drag) else 0.0


@helper
def outer_gain(stiffness: float, damping: float, apparent_mass: float, viscous: float) -> float:
    """The gain c1 = c3 = q (1/s) that renders ``stiffness`` (N/m) and ``damping`` (N s/m) with c2 = ``inner_gain``.

    Meaningless where ``damped_gains_miss``. Without c2, which K fixes, B is q^4 - 2 b q^3 + (2 k - 2 + b phi) q^2
    + 2 (b - k phi) q + k (k - 2) = 0 with k = K/m_e and b = B/m_e. Newton's method from above finds its largest root.
    """
    k, b, drag = stiffness / apparent_mass, damping / apparent_mass, viscous / apparent_mass
    square, linear, constant = 2.0 * k - 2.0 + b * drag, 2.0 * (b - k * drag), k * (k - 2.0)
    q = 2.0 * b
    for _ in range(DAMPED_ITERATIONS):
        value = (((q - 2.0 * b) * q + square) * q + linear) * q + constant
        q = q - value / (((4.0 * q - 6.0 * b) * q + 2.0 * square) * q + linear)
    return q


@helper
def inner_gain(outer: float, stiffness: float, apparent_mass: float, viscous: float) -> float:
    """The gain c2 (1/s) that renders ``stiffness`` (N/m) with c1 = c3 = ``outer`` (1/s)."""
    k, drag = stiffness / apparent_mass, viscous / apparent_mass
    return (2.0 * outer * (k - 1.0) - k * drag) / (outer * outer - k)


@helper
def damped_gains_miss(
    outer: float, inner: float, stiffness: float, damping: float, apparent_mass: float, viscous: float
) -> float:
    """1 where no gains c1 = c3 > sqrt(K/m_e), c2 > 0 render stiffness and damping, 0 where the two given ones do.

    What is not a number passes, as in ``equal_gain_misses``.
    """
    k, b = stiffness / apparent_mass, damping / apparent_mass
    pole = 2.0 * outer + inner - viscous / apparent_mass
    left = (outer + 2.0 * inner) * outer + 2.0 - k - b * pole
    return 1.0 if (k <= 1.0 or outer * outer <= k or inner <= 0.0 or pole <= 0.0 or abs(left) > TOLERANCE * b * pole) else 0.0


def closed_loop_stiffness(c1: float, c2: float, c3: float, apparent_mass: float, viscous: float) -> float:
    """Kcl (N/m) that gains c1, c2, c3 (1/s) render; raises ``ValueError`` where they render none."""
    denominator = c1 + c2 + c3 - viscous / apparent_mass
    if denominator <= 0:
        raise ValueError(f"c1 + c2 + c3 = {c1 + c2 + c3:g} 1/s; allowed: more than Fv/m_e = {viscous / apparent_mass:g} 1/s")
    return apparent_mass * (c1 + c3 + c1 * c2 * c3) / denominator


def closed_loop_damping(c1: float, c2: float, c3: float, apparent_mass: float, viscous: float) -> float:
    """B (N s/m) that gains c1, c2, c3 (1/s) render to slow pushes; raises ``ValueError`` where they render no stiffness."""
    stiffness = closed_loop_stiffness(c1, c2, c3, apparent_mass, viscous)
    a1 = c1 * c2 + c1 * c3 + c2 * c3 + 2
    return (apparent_mass * a1 - stiffness) / (c1 + c2 + c3 - viscous / apparent_mass)


def least_stiffness(apparent_mass: float, viscous: float) -> float:
    """The smallest Kcl (N/m) that equal gains can render: the minimum of m_e (c^3 + 2 c) / (3 c - Fv/m_e) over c.

    A setpoint below it leaves the cubic without a positive root above Fv/(3 m_e).
    """
    drag = viscous / apparent_mass
    # d/dc = 0: (3 c^2 + 2)(3 c - drag) = 3 (c^3 + 2 c), a cubic in c with one root above drag/3.
    low, high = drag / 3, max(drag, 1.0)
    for _ in range(200):
        c = (low + high) / 2
        if (3 * c * c + 2) * (3 * c - drag) < 3 * (c**3 + 2 * c):
            low = c
        else:
            high = c
    return apparent_mass * (high**3 + 2 * high) / (3 * high - drag) if drag > 0 else 2 * apparent_mass / 3


def least_damping(stiffness: float, apparent_mass: float, viscous: float) -> float:
    """The smallest B (N s/m) that gains c1 = c3 > sqrt(K/m_e), c2 > 0 render with ``stiffness`` (N/m): numerically.

    Every larger one can be rendered too. Raises ``ValueError`` for a stiffness that leaves c2 no positive value.
    """
    from scipy.optimize import minimize_scalar  # late: it takes 0.3 s, and a law does without

    k, drag = stiffness / apparent_mass, viscous / apparent_mass
    if not k > 1:
        raise ValueError(f"stiffness = {stiffness:g} N/m; allowed with a damping: more than m_e/s2 = {apparent_mass:g} N/m")

    def damping(log_excess: float) -> float:
        outer = max(math.sqrt(k), k * drag / (2 * (k - 1))) * (1 + math.exp(log_excess))
        return closed_loop_damping(outer, inner_gain(outer, stiffness, apparent_mass, viscous), outer, apparent_mass, viscous)

    grid = np.linspace(-16, 6, 221)
    middle = grid[int(np.argmin([damping(x) for x in grid]))]
    found = minimize_scalar(damping, bounds=(middle - 0.2, middle + 0.2), method="bounded", options={"xatol": 1e-9})
    return float(min(found.fun, damping(middle)))


def damping_range(stiffness: float, apparent_mass: float, viscous: float, gain_sum: float) -> tuple[float, float] | None:
    """Smallest and largest B (N s/m) that positive gains of sum a2 = ``gain_sum`` (1/s) render with ``stiffness`` (N/m).

    All in between can be had. None where no positive gains of this sum render the stiffness.
    """
    pole = gain_sum - viscous / apparent_mass
    nodes = _inner_gains(stiffness / apparent_mass * pole, gain_sum) if pole > 0 else []
    if not nodes:
        return None
    a1 = [_a1(x, stiffness / apparent_mass * pole, gain_sum) for x in nodes]
    low, high = ((apparent_mass * a - stiffness) / pole for a in (min(a1), max(a1)))
    return low, high


def _a1(c2: float, a0: float, a2: float) -> float:
    """a1 of the gains with this c2, a0 and a2: c1 + c3 = a2 - c2 and c1 c3 = 1 + (a0 - a2)/c2."""
    return c2 * (a2 - c2) + 3 + (a0 - a2) / c2


def _inner_gains(a0: float, a2: float) -> list[float]:
    """Ends and turning points, in order, of ``_a1`` over the interval of c2 where c1 and c3 are real and positive; or nothing.

    They are where (a2 - c2)^2 >= 4 (1 + (a0 - a2)/c2) > 0: one interval, since this cubic has one maximum below a2.
    """
    excess = a0 - a2

    def roots(*coefficients: float) -> list[float]:
        return [float(x.real) for x in np.roots(coefficients) if abs(x.imag) <= 1e-7 * abs(x) and 0 < x.real < a2]

    ends = [x for x in roots(1, -2 * a2, a2 * a2 - 4, -4 * excess) if x > -excess]
    if excess <= 0:
        ends.append(max(-excess * (1 + 1e-9), 1e-300))  # where c1 or c3 vanishes, so that the end itself is out
    if len(ends) < 2:
        return []
    return sorted([*ends, *(x for x in roots(2, -a2, 0, excess) if min(ends) < x < max(ends))])


def gains_for(
    stiffness: float, apparent_mass: float, viscous: float, damping: float | None = None, gain_sum: float | None = None
) -> tuple[float, float, float]:
    """Positive gains c1, c2, c3 (1/s) that render ``stiffness`` (N/m) and, where given, ``damping`` (N s/m).

    Without a damping they are equal; with one their sum is ``gain_sum`` (1/s), or without that as small as c1 = c3 allows.
    Of several solutions, which are one law, that with the largest c3. Raises ``ValueError`` for arguments that are not positive
    (``viscous``: negative) and where no positive gains exist, naming what does: stiffnesses for equal gains, else dampings.
    """
    given = {"stiffness": stiffness, "apparent_mass": apparent_mass, "damping": damping, "gain_sum": gain_sum}
    for name, value in given.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value!r}; allowed: a positive number")
    if not (math.isfinite(viscous) and viscous >= 0):
        raise ValueError(f"viscous = {viscous!r}; allowed: a number >= 0")
    rig = f"m_e = {apparent_mass:g} kg and Fv = {viscous:g} N s/m"
    if damping is None:
        if gain_sum is not None:
            raise ValueError(f"gain_sum = {gain_sum:g} without a damping; allowed: None, for equal gains have their own sum")
        if equal_gain_misses(stiffness, apparent_mass, viscous):
            least = least_stiffness(apparent_mass, viscous)
            raise ValueError(f"stiffness = {stiffness:g} N/m has no equal gains with {rig}; allowed: more than {least:g} N/m")
        c = equal_gain(stiffness, apparent_mass, viscous)
        return c, c, c
    if gain_sum is None:
        outer = outer_gain(stiffness, damping, apparent_mass, viscous)
        inner = inner_gain(outer, stiffness, apparent_mass, viscous)
        if damped_gains_miss(outer, inner, stiffness, damping, apparent_mass, viscous):
            least = least_damping(stiffness, apparent_mass, viscous)
            critical = 2 * math.sqrt(stiffness * apparent_mass)
            raise ValueError(
                f"damping = {damping:g} N s/m (ratio {damping / critical:.4g}) has no positive gains at {stiffness:g} N/m with "
                f"{rig}; allowed: at least {least:.6g} N s/m (ratio {least / critical:.4g})"
            )
        return outer, inner, outer
    span = damping_range(stiffness, apparent_mass, viscous, gain_sum)
    if span is None or not span[0] <= damping <= span[1]:
        allowed = "none with this sum" if span is None else f"{max(span[0], 0.0):.6g} to {span[1]:.6g} N s/m"
        raise ValueError(
            f"damping = {damping:g} N s/m has no positive gains of sum {gain_sum:g} 1/s at {stiffness:g} N/m with {rig}; "
            f"allowed: {allowed}"
        )
    drag = viscous / apparent_mass
    return _gains_of_sum(
        stiffness / apparent_mass * (gain_sum - drag), (damping * (gain_sum - drag) + stiffness) / apparent_mass, gain_sum
    )


def _gains_of_sum(a0: float, a1: float, a2: float) -> tuple[float, float, float]:
    """The gains with the largest c3, for an a1 that ``_a1`` takes between its nodes (rounding aside)."""
    from scipy.optimize import brentq  # late, as above

    nodes, found = _inner_gains(a0, a2), []
    for left, right in pairwise(nodes):
        at_left, at_right = _a1(left, a0, a2) - a1, _a1(right, a0, a2) - a1
        if at_left * at_right < 0:
            c2 = float(brentq(lambda x: _a1(x, a0, a2) - a1, left, right, xtol=1e-14, rtol=1e-14))
        else:
            c2 = left if abs(at_left) < abs(at_right) else right
        half, product = (a2 - c2) / 2, 1 + (a0 - a2) / c2
        c3 = half + math.sqrt(max(half * half - product, 0.0))
        found.append((abs(_a1(c2, a0, a2) - a1), (product / c3, c2, c3)))
    nearest = min(miss for miss, _ in found) + 1e-9 * abs(a1)
    return max((gains for miss, gains in found if miss <= nearest), key=lambda gains: gains[2])
