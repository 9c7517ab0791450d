"""The state model (13), (14) against (5) in SymPy and chambers (6) differentiated independently."""

import numpy as np
import pytest
import sympy as sp

from birthsim_env import Parameters
from tests.oracles import derived_law as derived
from tests.oracles.strict_feedback import neglected_acceleration, strict_feedback_rates
from tests.physics.rigs import TILTED

LANES = 40


@pytest.fixture(scope="module", params=[Parameters(), TILTED], ids=["default", "another rig"])
def case(request):
    """A rig, random sliding states with their chamber pressures and flows, X and U."""
    rig, rng = request.param, np.random.default_rng(3)
    y = rng.uniform(-0.8, 0.8, (2, LANES)) * [[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]]
    v = rng.uniform(0.01, 0.5, (2, LANES)) * rng.choice([-1, 1], (2, LANES))
    air, flow = rng.uniform(1.1e5, 6.9e5, (2, 2, LANES)), rng.uniform(-2e-3, 2e-3, (2, 2, LANES))
    x, u = np.empty((8, LANES)), np.empty((4, LANES))
    for i, cylinder, row in ((0, rig.cylinder1, 4), (1, rig.cylinder2, 0)):
        (ap, an), half = derived.areas(cylinder), cylinder.stroke / 2
        lp, ln = half + y[i], half - y[i]
        force = air[i, 0] * ap - air[i, 1] * an
        x[row : row + 4] = y[i], v[i], force, rig.air.polytropic_index * (air[i, 0] * ap / lp + air[i, 1] * an / ln)
        u[row // 2 : row // 2 + 2] = (half * (flow[i, 0] / lp - flow[i, 1] / ln), half * (flow[i, 0] / lp + flow[i, 1] / ln))
    return rig, y, v, air, flow, x, u


@pytest.mark.parametrize("neglected", [False, True])
def test_accelerations_are_those_of_equation_5(case, neglected):
    rig, y, v, _, _, x, u = case
    first, second = derived.equation_5(derived.F1, derived.F2)
    expressions = [first, second - (0 if neglected else 1) * derived.neglected()]
    function = sp.lambdify([*derived.STATE, *derived.RIG], expressions)
    expected = function(y[0], y[1], v[0], v[1], x[6], x[2], *derived.rig_values(rig, 0.0, True))
    rates = strict_feedback_rates(x, u, rig, neglected)
    np.testing.assert_allclose(rates[[5, 1]], expected, rtol=1e-11, atol=1e-11)
    np.testing.assert_array_equal(rates[[4, 0]], v)
    left_out = strict_feedback_rates(x, u, rig, True)[1] - strict_feedback_rates(x, u, rig)[1]
    np.testing.assert_allclose(neglected_acceleration(x, rig), left_out, rtol=1e-9, atol=1e-12)


def test_force_and_stiffness_rates_are_those_of_the_chambers(case):
    rig, y, v, air, flow, x, u = case
    rates = strict_feedback_rates(x, u, rig)
    for i, cylinder, row in ((0, rig.cylinder1, 4), (1, rig.cylinder2, 0)):
        expected = derived.force_and_stiffness_rates(air[i], flow[i], y[i], v[i], cylinder, rig)
        np.testing.assert_allclose(rates[row + 2 : row + 4], expected, rtol=1e-10, atol=1e-8)
