"""Stiffness, damping and all dampings that gains of one sum can render, from the polynomial of ``backstepping.gains``."""

import numpy as np

from baselines.backstepping.impedance import joint_impedance


def closed_loop_stiffness(c1: float, c2: float, c3: float, apparent_mass: float, viscous: float) -> float:
    return joint_impedance((c1, c2, c3), apparent_mass, viscous)[2]


def closed_loop_damping(c1: float, c2: float, c3: float, apparent_mass: float, viscous: float) -> float:
    return joint_impedance((c1, c2, c3), apparent_mass, viscous)[1]


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
