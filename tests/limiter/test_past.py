"""Signals at the time of a late position."""

import numpy as np
import pytest

from baselines.limiter.past import recall, slots_of

T = 0.001


class Past:
    """``rows`` signals of ``lanes``, once per period."""

    def __init__(self, period, rows, lanes):
        self.period, self.slots = period, slots_of(period)
        self.kept, self.newest = np.full((self.slots * rows, lanes), np.nan), np.zeros(lanes)

    def at(self, late, signals):
        told = np.empty_like(signals)
        for lane, periods in enumerate(late / self.period):
            recall(self.kept, self.newest, self.slots, periods, signals, told, lane)
        return told


def test_a_ramp_is_known_at_any_time_before():
    """A straight line between two periods is exact for a ramp."""
    past, late = Past(T, 1, 2), np.array([0.0043, 0.0271])
    for k in range(100):
        told = past.at(late, np.full((1, 2), 3.0 * k * T))
    np.testing.assert_allclose(told[0], 3.0 * (99 * T - late), rtol=1e-12)


def test_before_the_start_all_was_as_it_is_and_lanes_start_anew():
    past, late = Past(T, 1, 2), np.full(2, 0.01)
    assert past.at(late, np.full((1, 2), 5.0)) == pytest.approx(np.full((1, 2), 5.0))
    past.kept[:, 0] = np.nan  # as a stage that starts
    np.testing.assert_array_equal(past.at(late, np.full((1, 2), 7.0)), [[7.0, 5.0]])
