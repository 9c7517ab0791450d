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


def least_stiffness(apparent_mass: float, viscous: float) -> float:
    """The smallest Kcl (N/m) that equal gains can render: the minimum of m_e (c^3 + 2 c) / (3 c - Fv/m_e) over c.

    A setpoint below it leaves the cubic without a positive root above Fv/(3 m_e).
    """
    drag = viscous / apparent_mass
    # d/dc = 0: (3 c^2 + 2)(3 c - drag) = 3 (c^3 + 2 c), a cubic in c with one real root, above drag/3.
    c = float(np.roots([6, -3 * drag, 0, -2 * drag]).real.max())
    return apparent_mass * (c**3 + 2 * c) / (3 * c - drag) if drag > 0 else 2 * apparent_mass / 3


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
        inner = inner_gain(outer, stiffness, apparent_mass, viscous)
        return (apparent_mass * ((outer + 2 * inner) * outer + 2) - stiffness) / (2 * outer + inner - drag)

    grid = np.linspace(-16, 6, 221)
    middle = grid[int(np.argmin([damping(x) for x in grid]))]
    found = minimize_scalar(damping, bounds=(middle - 0.2, middle + 0.2), method="bounded", options={"xatol": 1e-9})
    return float(min(found.fun, damping(middle)))


def gains_for(
    stiffness: float, apparent_mass: float, viscous: float, damping: float | None = None
) -> tuple[float, float, float]:
    """Positive gains c1, c2, c3 (1/s) that render ``stiffness`` (N/m) and, where given, ``damping`` (N s/m).

    Without a damping they are equal; with one their sum is as small as c1 = c3 allows. Raises ``ValueError`` for arguments that
    are not positive (``viscous``: negative) and where no positive gains exist, naming what does: stiffnesses for equal gains,
    else dampings.
    """
    for name, value in (("stiffness", stiffness), ("apparent_mass", apparent_mass), ("damping", damping)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value!r}; allowed: a positive number")
    if not (math.isfinite(viscous) and viscous >= 0):
        raise ValueError(f"viscous = {viscous!r}; allowed: a number >= 0")
    rig = f"m_e = {apparent_mass:g} kg and Fv = {viscous:g} N s/m"
    if damping is None:
        if equal_gain_misses(stiffness, apparent_mass, viscous):
            least = least_stiffness(apparent_mass, viscous)
            raise ValueError(f"stiffness = {stiffness:g} N/m has no equal gains with {rig}; allowed: more than {least:g} N/m")
        c = equal_gain(stiffness, apparent_mass, viscous)
        return c, c, c
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
