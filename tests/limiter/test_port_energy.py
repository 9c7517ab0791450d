"""The work of a hand, in both counts, against closed forms of harmonic force and motion."""

import math

import numpy as np
import pytest

from baselines.limiter.port_energy import LAG, Energy, Work, count_work
from tests.limiter.test_port_limiter import T, seen, signals_of, targets

CYCLES, W, SIZE, FORCE = 20, 2 * math.pi * 5.0, 0.004, 20.0


class PortEnergy:
    def __init__(self, lanes):
        self.own, self.work = Energy(np.zeros((Energy.size, lanes))), Work(np.zeros((Work.size, lanes)))
        self.own.stamp[:] = -np.inf

    def update(self, measurement, reference, force):
        for lane in range(force.shape[1]):
            count_work(self.own, signals_of(measurement, reference), force, self.work, lane)
        return self.work


def counted(phase, size=SIZE):
    """J in both counts, of F = F0 cos(wt) and x = X sin(wt + phase), over whole cycles once the lags have settled."""
    energy, done, begin = PortEnergy(1), np.zeros(2), round(1.0 / T)
    for k in range(begin + round(CYCLES * 2 * math.pi / W / T) + 1):
        now = k * T
        force = np.array([[FORCE * math.cos(W * now)], [0.0]])
        work = energy.update(seen(now, np.array([size * math.sin(W * now + phase)]), 0.0, force[0]), targets(), force)
        assert (work.asked == 0.0).all()
        assert (work.path == 0.0).all()
        if k > begin:
            done += work.done[:, 0]
    return done


def late(lag):
    return 1 / math.hypot(1, W * lag), math.atan(W * lag)


@pytest.mark.parametrize("phase", [0.7, 0.0, math.pi / 2, -math.pi / 2])
def test_the_work_is_that_of_a_late_motion_and_that_of_a_force_one_lag_later(phase):
    """F0 X w cos(p)/2 per second without lags; a lag takes its gain and turns its phase. Sampled low-passes and trapezoids
    are late by half a period at most: w T of F0 X w/2."""
    (gain, angle), (slow, slower) = late(LAG), late(2 * LAG)
    whole = 0.5 * FORCE * SIZE * W * (CYCLES * 2 * math.pi / W)
    exact = whole * gain * np.array([math.cos(phase - angle), slow * math.cos(phase - angle + slower)])
    np.testing.assert_allclose(counted(phase), exact, rtol=0, atol=whole * W * T)


@pytest.mark.parametrize(("phase", "loser"), [(-math.pi / 2, 0), (math.pi / 2, 1)])
def test_an_oscillation_that_goes_on_is_given_in_one_of_the_counts(phase, loser):
    """x = -X cos(wt) under F0 cos(wt) is a hand that is a spring, x = X cos(wt) one that is a mass: neither gives nor takes."""
    done = counted(phase)
    assert done[loser] < 0.0 < done[1 - loser]


def test_a_position_that_is_not_new_does_no_work():
    energy, force = PortEnergy(1), np.full((2, 1), 10.0)
    energy.update(seen(0.0, np.array([0.0]), 0.0, 10.0), targets(), force)
    work = energy.update(seen(T, np.array([0.1]), 0.0, 10.0, late=T), targets(), force)
    assert (work.done == 0.0).all()
    assert energy.own.offset[0, 0] == 0.0
