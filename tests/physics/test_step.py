"""The step of integration: the order and the stability of its method, and that what the model allows is stable."""

import math

import numpy as np

from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of
from birthsim_env.physics.step import STEP

STABLE = 2.512745326618329
"""Where on the negative real axis the polynomial of third order reaches 1 in size."""


def stepped(rate: float, x: float, step: float) -> float:
    """One step of dx/dt = ``rate`` x (1 - x), or of dx/dt = ``rate`` x where ``x`` is 1."""
    total = trial = x
    for stage in range(STAGES):
        slope = rate * trial * (1 - trial if x != 1.0 else 1.0)
        total, trial = total + weight_of(stage, step) * slope, x + ahead_of(stage, step) * slope
    return total


def test_the_method_converges_with_its_order() -> None:
    """Growth with a bound, x = 1/(1 + 9 exp(-2 t)) over 1 s."""
    exact, errors = 1 / (1 + 9 * math.exp(-2.0)), []
    for steps in (10, 20, 40, 80):
        x = 0.1
        for _ in range(steps):
            x = stepped(2.0, x, 1 / steps)
        errors.append(abs(x - exact))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 3, atol=0.15)
    assert errors[-1] < 1e-7


def test_the_method_is_stable_up_to_where_its_polynomial_is() -> None:
    assert abs(stepped(-0.999 * STABLE, 1.0, 1.0)) < 1
    assert abs(stepped(-1.001 * STABLE, 1.0, 1.0)) > 1


def test_what_the_step_allows_is_stable() -> None:
    """The limits that the model sets leave at least a tenth of what is stable."""
    sound = math.sqrt(1.4 * 287.05 * 293.15)
    allowed = [
        STEP.relaxation_limit,
        STEP.elasto_plastic_limit,
        STEP.fastest_rate,
        sound / STEP.shortest_tube,
        STEP.fastest_air,
    ]
    assert max(allowed) * STEP.seconds < 0.91 * STABLE
