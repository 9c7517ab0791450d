"""Gains for a closed-loop stiffness and damping: formulas derived with SymPy, and the polynomials solved by other means."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import minimize_scalar

from baselines.backstepping.gains import equal_gain, equal_gain_misses, gains_for, least_stiffness
from birthsim_env.physics.compiled.lanes import Array
from tests.oracles.gain_range import closed_loop_damping, closed_loop_stiffness

C1, C2, C3, MASS, FV, PUSH = sp.symbols("c1 c2 c3 m Fv U", positive=True)
Y, V, F, WEIGHT = sp.symbols("y v F weight", real=True)


def wanted_rate(acceleration: sp.Expr) -> sp.Expr:
    """dF/dt of the backstepping law for a resting reference at y = 0, F* differentiated along y' = v, v' = ``acceleration``."""
    f, g = (WEIGHT - FV * V) / MASS, 1 / MASS
    z1, z2 = Y, V + C1 * Y
    star = (-C1 * V - f - z1 - C2 * z2) / g
    return star.diff(Y) * V + star.diff(V) * acceleration - z2 / g - C3 * (F - star)


def static_stiffness(acceleration: sp.Expr) -> sp.Expr:
    """Push / displacement where a piston that is pushed steadily has come to rest and the law asks for no more force."""
    balance = WEIGHT - FV * V + F + PUSH
    rest = sp.solve([balance.subs(V, 0), wanted_rate(acceleration).subs(V, 0)], [Y, F], dict=True)[0]
    return sp.simplify(PUSH / rest[Y])


@cache
def kcl() -> sp.Expr:
    """The static stiffness when the law differentiates along its model, which does not know the push."""
    return static_stiffness((WEIGHT - FV * V + F) / MASS)


@cache
def kcl_of_equal_gains() -> Callable[..., Array]:
    return sp.lambdify([C1, MASS, FV], kcl().subs({C2: C1, C3: C1}))


def test_static_formula_is_the_rest_state_of_the_law() -> None:
    a2, a0 = C1 + C2 + C3, C1 + C3 + C1 * C2 * C3
    assert sp.simplify(kcl() - MASS * a0 / (a2 - FV / MASS)) == 0
    measured = static_stiffness((WEIGHT - FV * V + F + PUSH) / MASS)
    assert sp.simplify(measured - MASS * a0 / C3) == 0, "with a measured acceleration: about three times stiffer"


def test_a0_and_a2_are_the_characteristic_polynomial_of_the_errors() -> None:
    """z1' = z2 - c1 z1, z2' = g z3 - z1 - c2 z2, z3' = -z2/g - c3 z3 as a matrix."""
    errors, s = sp.Matrix([[-C1, 1, 0], [-1, -C2, 1 / MASS], [0, -MASS, -C3]]), sp.symbols("s")
    leading, a2, _, a0 = sp.Poly(errors.charpoly(s).as_expr(), s).all_coeffs()
    assert leading == 1
    assert sp.expand(a2 - (C1 + C2 + C3)) == 0
    assert sp.expand(a0 - (C1 + C3 + C1 * C2 * C3)) == 0


@cache
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


A2, A1, A0 = C1 + C2 + C3, C1 * C2 + C1 * C3 + C2 * C3 + 2, C1 + C3 + C1 * C2 * C3


def test_impedance_of_the_error_dynamics() -> None:
    """Z(s) = m (s^3 + a2 s^2 + a1 s + a0) / (s + a2 - phi), and K, B are its first two terms at s = 0."""
    s = sp.symbols("s")
    assert sp.simplify(impedance() - MASS * (s**3 + A2 * s**2 + A1 * s + A0) / (s + A2 - FV / MASS)) == 0
    stiffness, damping = impedance().subs(s, 0), impedance().diff(s).subs(s, 0)
    pole = A2 - FV / MASS
    assert sp.simplify(stiffness - MASS * A0 / pole) == 0
    assert sp.simplify(damping - MASS * (A1 / pole - A0 / pole**2)) == 0
    symbols = [C1, C2, C3, MASS, FV]
    of_stiffness, of_damping = sp.lambdify(symbols, stiffness), sp.lambdify(symbols, damping)
    rng = np.random.default_rng(0)
    for _ in range(100):
        args = (*rng.uniform(20, 200, 3), rng.uniform(1, 20), rng.uniform(0, 50))
        assert closed_loop_stiffness(*args) == pytest.approx(of_stiffness(*args), rel=1e-12)
        assert closed_loop_damping(*args) == pytest.approx(of_damping(*args), rel=1e-12)


def test_the_cubic_of_c2() -> None:
    """With c1 + c3 = a2 - c2 and a1, a0 as they are, c2 solves c2^3 - a2 c2^2 + (a1 - 3) c2 + a2 - a0 = 0."""
    assert sp.expand(C2**3 - A2 * C2**2 + (A1 - 3) * C2 + A2 - A0) == 0


def test_gains_of_one_polynomial_are_one_law() -> None:
    """dF/dt as a feedback of y, v and F has coefficients of a2, a1, a0 (and the friction) alone."""
    rate = sp.expand(wanted_rate((WEIGHT - FV * V + F) / MASS))
    phi = FV / MASS
    assert sp.expand(rate.coeff(F) + A2 - phi) == 0
    assert sp.expand(rate.coeff(V).subs(F, 0) + MASS * A1 - FV * A2 + FV * phi) == 0
    assert sp.expand(rate.coeff(Y) + MASS * A0) == 0


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
        assert kcl_of_equal_gains()(gain, mass, viscous) == pytest.approx(stiffness, rel=1e-9)
        assert closed_loop_stiffness(gain, gain, gain, mass, viscous) == pytest.approx(stiffness, rel=1e-9)


@pytest.mark.parametrize("excess", [1.0, 1.0001, 1.001, 1.01, 1.03])
def test_equal_gain_renders_setpoints_beside_the_least(excess: float) -> None:
    """Two roots meet there and Newton slows down; what is rendered still differs little, for the curve is flat."""
    for mass, viscous in rigs(100, 3):
        stiffness = excess * least_stiffness(mass, viscous)
        rendered = kcl_of_equal_gains()(equal_gain(stiffness, mass, viscous), mass, viscous)
        assert rendered == pytest.approx(stiffness, rel=0.002)


def test_least_stiffness_is_the_minimum_over_the_gain() -> None:
    for mass, viscous in rigs(100, 4):
        least = least_stiffness(mass, viscous)
        if viscous == 0:
            # Falls towards m_e 2/3 as the gain vanishes.
            assert least == pytest.approx(kcl_of_equal_gains()(1e-6, mass, 0), rel=1e-9)
            continue

        def stiffness(above_pole: float, rig: tuple[float, float] = (mass, viscous)) -> float:
            return float(kcl_of_equal_gains()(rig[1] / rig[0] / 3 + np.exp(above_pole), *rig))

        found = minimize_scalar(stiffness, bounds=(-12, 8), method="bounded", options={"xatol": 1e-9})
        assert least == pytest.approx(found.fun, rel=1e-9)


@pytest.mark.parametrize("fraction", [0.99, 0.7, 0.3, 0.05, 0.0])
def test_a_setpoint_out_of_reach_gets_the_nearest_that_can_be_had(fraction: float) -> None:
    """With the drag Fv/m_e of any real rig (above 7 1/s) that is the least stiffness; never a negative one."""
    for mass, viscous in rigs(200, 5):
        least = least_stiffness(mass, viscous)
        rendered = kcl_of_equal_gains()(equal_gain(fraction * least, mass, viscous), mass, viscous)
        assert 0 < least <= rendered * (1 + 1e-12)
        if viscous / mass > 7:
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
    assert equal_gain_misses(np.nan, 3.0, 35.0) == 0, "a state out of range is not the setpoint's fault"
