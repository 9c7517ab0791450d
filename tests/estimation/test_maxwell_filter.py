"""The filter of generalised Maxwell slip: its path against elements in plain Python, its covariances, its grip."""

import numpy as np
import pytest

from baselines.estimation.hand import bristle_filter, friction_candidates, maxwell_filter
from baselines.estimation.hand.friction_candidates import MAXWELL
from baselines.estimation.hand.maxwell_filter import Elements
from birthsim_env.physics.seals.maxwell_slip import ELEMENTS, REACH, STIFFNESS
from tests.estimation.test_bristle_filter import COULOMB, COVARIANCE, MASS, PERIOD, RIG, S0, S1, STRIBECK, VISCOUS, P

LAW = friction_candidates.law_of(MAXWELL, P)


def elements():
    b = Elements(np.zeros((Elements.size, 1)))
    b.level[:] = COULOMB
    maxwell_filter.begin(b, 1, 0, LAW, P)
    return b


def reach(speed):
    level = COULOMB * (1.0 + (RIG.friction.static_ratio - 1.0) / (1.0 + (speed / STRIBECK) ** 2))
    return np.array(REACH) * level / S0


def test_it_moves_as_elements_that_stick_or_slip():
    b, y, v, z, grip = elements(), 0.0, 0.0, np.zeros(ELEMENTS), 1.0
    turned = 0
    for k in range(4000):
        load = 25.0 * np.sin(2 * np.pi * 0.7 * k * PERIOD)
        maxwell_filter.predict(b, 1, 0, load, 0.0, 1.0 / MASS, 0.0, 0.0, LAW, P, PERIOD)
        z = np.clip(z, -reach(v), reach(v))
        v += PERIOD / MASS * (load - VISCOUS * v - S0 * np.dot(STIFFNESS, z) - S1 * grip * v)
        moved = z + PERIOD * v
        z = np.clip(moved, -reach(v), reach(v))
        was, grip = grip, np.dot(STIFFNESS, moved == z)
        y += PERIOD * v
        turned += was < 0.5 < grip
        assert (b.position[1, 0], b.speed[1, 0]) == pytest.approx((y, v), abs=1e-12)
        assert (b.bristle[1, 0], b.grip[1, 0]) == pytest.approx((np.dot(STIFFNESS, z), grip), abs=1e-12)
    assert turned > 3  # it slipped, and stuck again where it turned round


def test_covariances_are_carried_on_by_the_derivatives_of_the_step():
    """P' = A P A^T + Q, with A from central differences, while all elements stick."""
    rng = np.random.default_rng(3)
    root = rng.standard_normal((4, 4)) * np.array([1e-4, 1e-2, 3e-6, 2.0])[:, None]
    before = root @ root.T

    def step(state):
        b = elements()
        b.position[1], b.speed[1], b.bristle[1], b.push[1] = state
        b.surprise[1], b.element[ELEMENTS:, 0] = 1.0, bent
        for name, (i, j) in zip(COVARIANCE, zip(*np.triu_indices(4), strict=True), strict=True):
            getattr(b, name)[1] = before[i, j]
        maxwell_filter.predict(b, 1, 0, 3.0, 0.0, 1.0 / MASS, 1.0, 2.0, LAW, P, PERIOD)
        after = np.zeros((4, 4))
        after[np.triu_indices(4)] = [getattr(b, name)[1, 0] for name in COVARIANCE]
        return np.array([b.position[1, 0], b.speed[1, 0], b.bristle[1, 0], b.push[1, 0]]), after

    bent = 0.05 * reach(0.0)
    start = np.array([0.01, 0.005, np.dot(STIFFNESS, bent), 5.0])
    sizes = np.array([1e-7, 1e-6, 1e-9, 1e-4])
    slopes = np.transpose([(step(start + e)[0] - step(start - e)[0]) / (2 * e.sum()) for e in np.diag(sizes)])
    expected = slopes @ before @ slopes.T
    expected[1, 1] += PERIOD * bristle_filter.SPEED_NOISE
    expected[3, 3] += PERIOD * 1.0 * (1.0 + 2.0)
    size, upper = np.outer(*[np.sqrt(np.diag(expected))] * 2), np.triu_indices(4)
    np.testing.assert_allclose((step(start)[1] / size)[upper], (expected / size)[upper], atol=1e-4)


def test_what_elements_that_slip_were_off_is_forgotten():
    """Where the first begins to slip, whose share is 0.4, the deviation of z falls to 0.6; once all do, to nothing."""
    for ratio, left in ((0.999 * REACH[0] / np.array(REACH), 1.0 - STIFFNESS[0]), (0.999, 0.0)):
        b = elements()
        b.speed[1], b.surprise[1], b.zz[1] = 0.01, 1.0, 1e-16
        b.element[ELEMENTS:, 0] = bent = ratio * reach(0.01)
        b.bristle[1] = np.dot(STIFFNESS, bent)
        maxwell_filter.predict(b, 1, 0, S0 * b.bristle[1, 0], 0.0, 1.0 / MASS, 0.0, 0.0, LAW, P, PERIOD)
        assert b.grip[1, 0] == pytest.approx(left)
        assert b.zz[1, 0] == pytest.approx(left**2 * 1e-16, rel=0.15)
