"""Backstepping gains for a closed-loop stiffness.

With a2 = c1 + c2 + c3 and a0 = c1 + c3 + c1 c2 c3, the piston gives way to a steady force by force / Kcl with
    Kcl = m_e a0 / (a2 - Fv/m_e).
Equal gains c turn that into the cubic m_e c^3 + (2 m_e - 3 Kcl) c + Kcl Fv/m_e = 0; its largest root is taken.
"""

from __future__ import annotations

import math

from birthsim_env.compilation import helper

ITERATIONS = 8
"""Newton from above on a convex function: quadratic, at rounding error after six unless beside the least stiffness."""


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


def closed_loop_stiffness(c1: float, c2: float, c3: float, apparent_mass: float, viscous: float) -> float:
    """Kcl (N/m) that gains c1, c2, c3 (1/s) render; raises ``ValueError`` where they render none."""
    denominator = c1 + c2 + c3 - viscous / apparent_mass
    if denominator <= 0:
        raise ValueError(f"c1 + c2 + c3 = {c1 + c2 + c3:g} 1/s; allowed: more than Fv/m_e = {viscous / apparent_mass:g} 1/s")
    return apparent_mass * (c1 + c3 + c1 * c2 * c3) / denominator


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
