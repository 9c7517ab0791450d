"""Super-twisting: its gains against Moreno's condition, its sampled term, and how it reaches its surface."""

import math

import numpy as np
import pytest

from baselines.rivals.super_twisting import ROOT_GAIN, SIGN_GAIN, SuperTwisting, twist
from tests.oracles import derived_law as derived
from tests.rivals.test_rival_laws import PERIOD, beside_rest, on_the_model
from tests.rivals.unseen_weight import WEIGHTLESS


@pytest.mark.parametrize("bound", [30.0, 1e5])
def test_gains_satisfy_the_frequency_condition(bound: float) -> None:
    """C (jw - A)^-1 B of A = [[-k1/2, 1/2], [-k2, 0]], scaled by the bound's root so that both states are alike."""
    k1, k2, rate = ROOT_GAIN * np.sqrt(bound), SIGN_GAIN * bound, np.sqrt(bound)
    a, b, c = np.array([[-k1 / 2, 0.5], [-k2, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    peak = max(abs(c @ np.linalg.solve(1j * w * np.eye(2) - a, b)) for w in rate * np.linspace(0, 3, 3001))
    assert 0.9 < peak * bound < 1.0


def test_the_sampled_term_reaches_zero_under_whatever_its_gains_bound() -> None:
    """A perturbation that turns at the bound's rate: what it asks for is zero, and s what the perturbation does in a period."""
    bound = 2000.0
    gains = ROOT_GAIN * np.sqrt(bound), SIGN_GAIN * bound
    s, z = 3.0, 0.0
    for tick in range(3000):
        after, z = twist(s, z, *gains, PERIOD)
        pushed = 100.0 * np.sin(0.95 * bound / 100.0 * tick * PERIOD)
        s = after + PERIOD * pushed
        assert tick < 1500 or abs(after) < 1e-12
    assert abs(s) <= 100.0 * PERIOD


def test_the_term_solves_its_implicit_equation() -> None:
    rng, k1, k2 = np.random.default_rng(1), 40.0, 600.0
    for s, z in rng.normal(0, [1e-3, 0.5], (200, 2)):
        after, new = twist(s, z, k1, k2, PERIOD)
        assert after == pytest.approx(s - PERIOD * (k1 * np.sqrt(abs(after)) * np.sign(after) - new), abs=1e-12)
        assert abs(new - z) <= PERIOD * k2 * (1 + 1e-9)


def test_it_reaches_its_surface_as_the_differential_equation_says() -> None:
    """From beside the target, weightless and with linear valves: s follows ds/dt = -k1 |s|^(1/2) sign(s) + z, then is zero."""
    r, bound, offset = 25.0, 200.0, np.array([-4e-4, 9e-4])
    law = SuperTwisting(WEIGHTLESS, surface_rate=r, rate_bound=bound, friction_fraction=0.0, dead_zone=0.0)
    start, reference, _, scale = beside_rest(WEIGHTLESS, offset)
    path = np.array(list(on_the_model(law, WEIGHTLESS, start, reference, 0.6)))
    error = path[:, :2] - start[:2] + offset
    summed = np.cumsum(np.vstack([np.zeros(2), error[:-1]]), axis=0) * PERIOD
    model = derived.accelerations(WEIGHTLESS, 0.01, True)
    second = np.array([model(*x[:4], *derived.forces(x[4:], WEIGHTLESS)) for x in path])
    surface = scale * (second + 3 * r * path[:, 2:4] + 3 * r**2 * error + r**3 * summed)
    k1, k2 = ROOT_GAIN * np.sqrt(bound), SIGN_GAIN * bound

    for i in range(2):
        # In small steps of Euler's method: at s = 0, where the right-hand side jumps, adaptive ones never end.
        s, z, fine, exact = float(surface[0, i]), 0.0, 100, list[float]()
        for tick in range(fine * len(path)):
            if tick % fine == 0:
                exact.append(s)
            way = math.copysign(1.0, s)
            s, z = s + PERIOD / fine * (z - k1 * math.sqrt(abs(s)) * way), z - PERIOD / fine * k2 * way
        assert abs(surface[0, i]) > 0.5
        assert np.abs(surface[:, i] - exact).max() < 0.04 * abs(surface[0, i])
        assert np.abs(surface[-100:, i]).max() < 0.01 * abs(surface[0, i])


def test_z_and_the_integral_rest_while_a_valve_is_full() -> None:
    from tests.rivals.test_rivals import test_integrals_rest_while_a_valve_is_full as rests

    rests(SuperTwisting)
