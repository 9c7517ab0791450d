"""Statistics of episodes: lost ones, quantiles, bootstrap intervals against exact distributions, paired ratios."""

import json
import math
from itertools import product

import numpy as np
import pytest
from scipy import stats

from baselines.bench.statistics import LEVEL, LOST_ERROR, jsonable, number, penalize_lost, quantile, summarize
from lab.studies.comparison import paired
from lab.studies.comparison.paired import median_interval, paired_ratios, summary_with_interval

INF, NAN = math.inf, math.nan


def test_a_lost_episode_is_infinitely_bad_whatever_its_figures_were():
    np.testing.assert_array_equal(penalize_lost([1.0, 2.0, NAN, 4.0], [False, True, True, False]), [1, INF, INF, 4])
    # A metric of which no episode says anything does not become one by losing episodes, unless others say it applies.
    np.testing.assert_array_equal(penalize_lost([NAN, NAN], [True, False]), [NAN, NAN])
    np.testing.assert_array_equal(penalize_lost([NAN, NAN], [True, False], applies=True), [INF, NAN])
    np.testing.assert_array_equal(penalize_lost([3.0, 1.0], [True, False], applies=False), [3, 1])
    np.testing.assert_array_equal(penalize_lost([3.0, INF], [True, False], True, LOST_ERROR), [100, INF])


@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.5, 0.95, 1.0])
def test_quantiles_are_numpys_where_all_is_finite(fraction):
    values = np.random.default_rng(1).normal(size=31)
    assert quantile(values, fraction) == pytest.approx(np.quantile(values, fraction), rel=1e-12)
    assert quantile([*values, NAN], fraction) == quantile(values, fraction)


def test_a_quantile_that_leans_on_a_lost_episode_is_infinite_and_others_are_not():
    values = [1.0, 2.0, 3.0, INF]
    assert quantile(values, 0.5) == 2.5
    assert quantile(values, 2 / 3) == 3.0
    assert quantile(values, 0.7) == quantile(values, 1.0) == INF
    assert quantile([1.0, INF], 0.5) == INF
    assert quantile([INF, INF], 0.5) == INF
    assert math.isnan(quantile([NAN], 0.5))


def test_summarize_takes_tails_by_size_and_ignores_what_says_nothing():
    result = summarize([1.0, -10.0, 3.0, NAN, 2.0])
    assert result["median"] == 1.5
    assert result["mean"] == -1.0
    assert result["max"] == 10.0
    assert result["q95"] == pytest.approx(np.quantile([1, 10, 3, 2], 0.95))
    nothing = summarize([NAN, NAN])
    assert set(nothing) == {"median", "mean", "q95", "max"}
    assert all(math.isnan(value) for value in nothing.values())
    assert math.isnan(summarize([])["max"])


@pytest.mark.parametrize("count", [15, 31, 63])
def test_bootstrap_interval_is_that_of_the_exact_bootstrap_distribution(count):
    """For odd n the resampled median is at most the k-th value iff at least (n+1)/2 of n draws fall on the first k."""
    values = np.sort(np.random.default_rng(3).lognormal(size=count))
    below = stats.binom.sf((count + 1) // 2 - 1, count, np.arange(1, count + 1) / count)
    low, high = median_interval(np.random.default_rng(0).permutation(values))
    tail = (1 - LEVEL) / 2
    # Resampling moves a bound by at most one rank, and only where the exact probability is beside the level.
    for bound, level in ((low, tail), (high, 1 - tail)):
        rank = int(np.flatnonzero(values == bound)[0])
        assert below[rank] > level - 0.006
        assert rank == 0 or below[rank - 1] < level + 0.006


def test_of_an_even_number_the_resampled_median_is_the_mean_of_the_middle_two(monkeypatch):
    values = (0.0, 1.0, 3.0, 7.0)
    medians = np.sort([np.median(chosen) for chosen in product(values, repeat=4)])
    monkeypatch.setattr(paired, "LEVEL", 0.5)
    assert median_interval(values) == (medians[64], medians[191])


def test_the_interval_is_the_same_at_every_call_whatever_the_order_and_ignores_what_says_nothing():
    values = np.random.default_rng(5).normal(size=32)
    first = median_interval(values)
    assert median_interval(values[::-1]) == first
    assert median_interval([*values, NAN]) == first
    assert first[0] < np.median(values) < first[1]


def test_lost_episodes_make_the_upper_bound_infinite_and_then_the_lower():
    kept = list(np.linspace(1, 2, 32))
    few, half, all_lost = ([*kept[: 32 - lost], *([INF] * lost)] for lost in (2, 16, 32))
    assert math.isfinite(median_interval(few)[1])
    assert median_interval(few)[1] >= median_interval(kept)[1]
    low, high = median_interval(half)
    assert math.isfinite(low)
    assert high == INF
    assert median_interval(all_lost) == (INF, INF)
    assert all(math.isnan(bound) for bound in median_interval([NAN]))
    assert median_interval([3.0]) == (3.0, 3.0)


def test_ratios_are_by_episode_and_equal_where_both_are_lost_or_nothing():
    mine = [2.0, -3.0, INF, 1.0, INF, 0.0, 1.0, NAN]
    reference = [4.0, 1.5, 1.0, INF, INF, 0.0, 0.0, 1.0]
    np.testing.assert_array_equal(paired_ratios(mine, reference), [0.5, 2.0, INF, 0.0, 1.0, 1.0, INF, NAN])


def test_description_is_of_the_sizes():
    result = summary_with_interval([-3.0, 1.0, 2.0, NAN])
    assert result["median"] == 2.0
    assert result["worst"] == 3.0
    assert result["count"] == 3
    assert result["low"] <= 2 <= result["high"]
    assert result["q95"] == pytest.approx(np.quantile([1, 2, 3], 0.95))
    lost = summary_with_interval([INF, INF, 1.0])
    assert lost["median"] == lost["worst"] == INF


def test_numbers_and_json_say_lost():
    assert [number(value) for value in (1.23456, INF, NAN, 1234.5)] == ["1.23", "lost", "-", "1.23e+03"]
    said = jsonable([{"a": {"median": INF, "low": 1.5}, "count": 3}])
    assert json.loads(json.dumps(said, allow_nan=False)) == [{"a": {"median": "lost", "low": 1.5}, "count": 3}]
