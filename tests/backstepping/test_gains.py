"""Gains for a closed-loop stiffness: the impedance derived with SymPy, and the polynomial solved by other means."""

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import minimize_scalar

from baselines.backstepping.gains import equal_gain, equal_gain_misses, gains_for, least_stiffness
from tests.oracles.gain_range import closed_loop_damping, closed_loop_stiffness

C1, C2, C3, MASS, FV = sp.symbols("c1 c2 c3 m Fv", positive=True)
Y, V = sp.symbols("y v", real=True)


def impedance() -> sp.Expr:
    """Push over displacement in s. The push accelerates the piston (z2') and, through dF*/dv, lets F lag behind F* (z3')."""
    s, z1, z2, z3, push = sp.symbols("s z1 z2 z3 push")
    star = MASS * (-C1 * V - (Y + C2 * (V + C1 * Y))) + FV * V
    missed = star.diff(V) * push / MASS
    equations = [
        s * z1 - (z2 - C1 * z1),
        s * z2 - (z3 / MASS - z1 - C2 * z2 + push / MASS),
        s * z3 - (-MASS * z2 - C3 * z3 - missed),
    ]
    return sp.simplify(push / sp.solve(equations, [z1, z2, z3], dict=True)[0][z1])


def test_impedance_of_the_error_dynamics() -> None:
    """Z(s) = m (s^3 + a2 s^2 + a1 s + a0) / (s + a2 - phi), and K, B are its first two terms at s = 0."""
    s, found = sp.symbols("s"), impedance()
    a2, a1, a0 = C1 + C2 + C3, C1 * C2 + C1 * C3 + C2 * C3 + 2, C1 + C3 + C1 * C2 * C3
    assert sp.simplify(found - MASS * (s**3 + a2 * s**2 + a1 * s + a0) / (s + a2 - FV / MASS)) == 0
    of_stiffness, of_damping = (sp.lambdify([C1, C2, C3, MASS, FV], one.subs(s, 0)) for one in (found, found.diff(s)))
    rng = np.random.default_rng(0)
    for _ in range(100):
        args = (*rng.uniform(20, 200, 3), rng.uniform(1, 20), rng.uniform(0, 50))
        assert closed_loop_stiffness(*args) == pytest.approx(of_stiffness(*args), rel=1e-12)
        assert closed_loop_damping(*args) == pytest.approx(of_damping(*args), rel=1e-12)


def of_equal_gains(gain: float, mass: float, viscous: float) -> float:
    """The stiffness that they render, N/m."""
    return closed_loop_stiffness(gain, gain, gain, mass, viscous)


def rigs(count: int, seed: int) -> list[tuple[float, float]]:
    """Apparent masses from 0.3 to 100 kg with viscous friction from 0 to 200 N s/m."""
    rng = np.random.default_rng(seed)
    masses, viscous = 10 ** rng.uniform(-0.5, 2, count), 10 ** rng.uniform(-2, 2.3, count)
    viscous[: count // 10] = 0
    return list(zip(masses, viscous, strict=True))


def test_equal_gain_is_the_largest_root_and_renders_the_setpoint() -> None:
    """Setpoints from 1.1 times the least possible to ten thousand times it."""
    rng = np.random.default_rng(1)
    for mass, viscous in rigs(400, 2):
        stiffness = least_stiffness(mass, viscous) * 1.1 * 10 ** rng.uniform(0, 4)
        gain = equal_gain(stiffness, mass, viscous)
        roots = np.roots([mass, 0, 2 * mass - 3 * stiffness, stiffness * viscous / mass])
        assert np.abs(roots.imag).max() <= 1e-9 * gain, "all roots of a feasible setpoint are real"
        assert gain == pytest.approx(roots.real.max(), rel=1e-8)
        assert of_equal_gains(gain, mass, viscous) == pytest.approx(stiffness, rel=1e-9)


def test_least_stiffness_is_the_minimum_over_the_gain() -> None:
    for mass, viscous in rigs(100, 4):
        least = least_stiffness(mass, viscous)
        if viscous == 0:
            # Falls towards m_e 2/3 as the gain vanishes.
            assert least == pytest.approx(of_equal_gains(1e-6, mass, 0), rel=1e-9)
            continue

        def stiffness(above_pole: float, rig: tuple[float, float] = (mass, viscous)) -> float:
            return float(of_equal_gains(rig[1] / rig[0] / 3 + np.exp(above_pole), *rig))

        found = minimize_scalar(stiffness, bounds=(-12, 8), method="bounded", options={"xatol": 1e-9})
        assert least == pytest.approx(found.fun, rel=1e-9)


@pytest.mark.parametrize("fraction", [1.03, 1.01, 1.001, 1.0001, 1.0, 0.99, 0.7, 0.3, 0.05, 0.0])
def test_a_setpoint_beside_the_least_is_rendered_and_one_out_of_reach_gets_the_nearest(fraction: float) -> None:
    """Two roots meet there; out of reach, with the drag Fv/m_e of any real rig (above 7 1/s), it is the least stiffness."""
    for mass, viscous in rigs(200, 5):
        least = least_stiffness(mass, viscous)
        rendered = of_equal_gains(equal_gain(fraction * least, mass, viscous), mass, viscous)
        assert 0 < least <= rendered * (1 + 1e-12)
        if fraction >= 1:
            assert rendered == pytest.approx(fraction * least, rel=0.002)
        elif viscous / mass > 7:
            assert rendered == pytest.approx(least, rel=0.01)


def test_equal_gains_are_refused_below_the_least_stiffness() -> None:
    for mass, viscous in rigs(200, 10):
        least = least_stiffness(mass, viscous)
        assert equal_gain_misses(least * (1 - 1e-6), mass, viscous) == 1
        assert equal_gain_misses(least * (1 + 1e-6), mass, viscous) == 0
        c = gains_for(least * 1.2, mass, viscous)
        assert c[0] == c[1] == c[2] == equal_gain(least * 1.2, mass, viscous)
        with pytest.raises(ValueError, match=rf"stiffness = .* N/m has no equal gains .* allowed: more than {least:g} N/m"):
            gains_for(least * 0.9, mass, viscous)
    assert equal_gain_misses(2.0, 3.0, 0.0) == 1, "without friction the least, two thirds of the mass, is a gain of zero"
    assert equal_gain_misses(np.nan, 3.0, 35.0) == 0, "a state out of range is not the setpoint's fault"
    right = {"stiffness": 2000.0, "apparent_mass": 3.0, "viscous": 35.0, "damping": 200.0}
    for name, wrong in (("stiffness", 0.0), ("apparent_mass", 0.0), ("viscous", -1.0), ("damping", 0.0)):
        with pytest.raises(ValueError, match=rf"{name} = {wrong}; allowed: a .*(positive|>= 0)"):
            gains_for(**(right | {name: wrong}))
    with pytest.raises(ValueError, match=r"stiffness = 3 N/m; allowed with a damping: more than m_e/s2 = 3 N/m"):
        gains_for(**(right | {"stiffness": 3.0}))
