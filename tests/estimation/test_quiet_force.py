"""A force that is found follows a hand, and not its noise."""

import numpy as np
import pytest

from baselines.estimation.hand import quiet_force
from baselines.estimation.hand.quiet_force import Quiet

PERIOD = 1e-3


def used(found):
    """What a law uses of forces (T, 2), N."""
    quiet, fresh, force, path = Quiet(np.zeros((Quiet.size, 1))), np.ones(1), np.zeros((2, 1)), []
    for one in found:
        quiet_force.quieten(quiet, np.array(one)[:, None], PERIOD, fresh, force)
        fresh[:] = 0.0
        path.append(force[:, 0].copy())
    return np.array(path)


def test_noise_within_the_circle_moves_it_by_the_drift_alone():
    path = used(np.random.default_rng(0).uniform(-1.0, 1.0, (8000, 2)))
    assert np.abs(np.diff(path, axis=0)).max() <= PERIOD * quiet_force.DRIFT * 2.0
    # A first-order low-pass of 1 1/s leaves sqrt(period/2)/sqrt(3) = 0.013 N of such noise, and e^-8 of where it began.
    assert np.abs(path[-1]).max() < 4 * 0.013


def test_a_push_is_followed_to_the_rim_at_once_and_to_its_middle_with_the_drift():
    push = np.zeros((4000, 2))
    push[1000:] = [12.0, 16.0]
    path = used(push)
    np.testing.assert_allclose(path[1000], [12.0 * 0.9, 16.0 * 0.9], rtol=0.01)
    away = np.hypot(*(path[3000] - push[3000]))
    assert away == pytest.approx(quiet_force.RADIUS * np.exp(-quiet_force.DRIFT * 2.0), rel=0.02)


def test_a_swing_moves_less_and_less_until_it_ends():
    time = np.arange(6000) * PERIOD
    swing = np.zeros((6000, 2))
    swing[:3000, 0] = 6.0 * np.sin(2 * np.pi * 8.0 * time[:3000])
    path = used(swing)
    first, later = np.ptp(path[:125, 0]), np.ptp(path[2875:3000, 0])
    assert first > 4.0
    # Radius 2 + 1.5 x 6 N is beyond the swing: what is left is the drift's share, twice 6 N / (2 pi 8 Hz 1 s).
    assert later < 2.5 * 6.0 / (2 * np.pi * 8.0)
    step = np.full((6000, 2), 20.0)
    np.testing.assert_allclose(used(np.concatenate([swing, step]))[-1], 20.0, atol=0.1)
