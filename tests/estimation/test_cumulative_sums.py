"""The test that makes a filter quick: against Page's recursion written as a maximum over past sums, and on a simulated step."""

import numpy as np
import pytest

from baselines.estimation.hand import bristle_filter, cumulative_sums
from baselines.estimation.hand.bristle_filter import Bristled
from baselines.estimation.hand.cumulative_sums import BOOST, DRIFT, FADES, LEVEL, CumulativeSums
from tests.estimation.test_bristle_filter import COULOMB, LUGRE, MASS, NOISE, PERIOD, P, filter_of, piston


def started():
    sums = CumulativeSums(np.full((CumulativeSums.size, 1), 3.0))
    cumulative_sums.begin(sums, 1, 0)
    return sums


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_sum_is_the_largest_excess_over_the_drift_of_any_past_window(way):
    innovations = way * np.random.default_rng(0).normal(0.3, 1.0, 200)
    sums, alarms = started(), []
    since = 0
    for k, innovation in enumerate(innovations):
        cumulative_sums.take(sums, 1, 0, innovation)
        # sum over j..k of n - DRIFT, at its largest over the start j; nothing from before the last alarm.
        up, down = (max(0.0, *np.cumsum((sign * innovations[since : k + 1] - DRIFT)[::-1])) for sign in (1.0, -1.0))
        if max(up, down) > LEVEL:
            alarms.append(k)
            since, up, down = k + 1, 0.0, 0.0
            assert sums.boost[1, 0] == BOOST
        assert (sums.up[1, 0], sums.down[1, 0]) == pytest.approx((up, down))
    assert alarms
    assert (sums.rows[CumulativeSums.up.place][0], sums.boost[0, 0]) == (3.0, 3.0)  # piston 1 is left alone


def test_what_an_alarm_leaves_fades_with_its_time_constant():
    sums = started()
    cumulative_sums.take(sums, 1, 0, LEVEL + 1.0)
    for _ in range(round(FADES / PERIOD)):
        cumulative_sums.fade(sums, 1, 0, PERIOD)
    assert sums.boost[1, 0] == pytest.approx(BOOST * np.exp(-1.0), rel=0.01)


def test_noise_alone_seldom_alarms():
    rng, sums, alarms = np.random.default_rng(1), started(), 0
    for innovation in rng.standard_normal(24_000):  # 100 s at 240 Hz
        cumulative_sums.take(sums, 1, 0, innovation)
        alarms += sums.boost[1, 0] > 0.0
        sums.boost[1, 0] = 0.0
    # Siegmund 1985: one side (exp(2 k b) - 1 - 2 k b)/(2 k^2) samples with b = level + 1.166, both half of that.
    b = LEVEL + 1.166
    apart = 0.5 * (np.exp(2 * DRIFT * b) - 1 - 2 * DRIFT * b) / (2 * DRIFT**2)
    assert 0.5 * 24_000 / apart < alarms < 2.0 * 24_000 / apart


def found_after_step(quick, seed):
    """Force, N, that a filter with a calm prior finds of a step of 4 N on a LuGre piston at rest, 0.2 s after it began."""
    time = np.arange(1200) * PERIOD
    path, rng, sums = piston(time, lambda t: 4.0 if t > 1.0 else 0.0), np.random.default_rng(seed), started()
    b = filter_of(COULOMB)
    bristle_filter.begin(b, 1, 0, path[0], 0.0, 0.0, NOISE, LUGRE, P)
    for k in range(len(time)):
        boost = sums.boost[1, 0] if quick else 0.0
        bristle_filter.predict(b, 1, 0, 0.0, 0.0, 1.0 / MASS, 0.3, boost, 0.0, LUGRE, P, PERIOD)
        if k % 4 == 0:
            innovation = path[k] + NOISE * rng.standard_normal() - b.position[1, 0]
            variance = bristle_filter.correct(b, 1, 0, innovation, NOISE)
            cumulative_sums.take(sums, 1, 0, innovation / np.sqrt(variance))
        cumulative_sums.fade(sums, 1, 0, PERIOD)
    assert isinstance(b, Bristled)
    return b.push[1, 0]


def test_a_step_at_rest_is_found_sooner_with_the_test():
    with_test, without = (np.array([found_after_step(quick, seed) for seed in range(8)]) for quick in (True, False))
    # Without it little more than half of the step is found by then.
    assert without.mean() < 0.85 * 4.0
    assert with_test.mean() > without.mean() + 1.0
