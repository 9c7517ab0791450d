"""Figures of many episodes beside those of another controller: ratios episode by episode, and intervals of the median."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.bench.statistics import LEVEL, given_in, quantile
from birthsim_env.physics.compiled.lanes import Array

RESAMPLES = 9999
"""Bootstrap samples of an interval: 0.2 % of the interval's width in error."""


@cache
def _middles(count: int) -> NDArray[np.intp]:
    """Ranks (RESAMPLES, 2) of the two middle values in resamples of ``count`` sorted values, from a fixed seed."""
    ranks = np.sort(np.random.default_rng(count).integers(count, size=(RESAMPLES, count)), axis=1)
    return ranks[:, [(count - 1) // 2, count // 2]]


def median_interval(values: ArrayLike) -> tuple[float, float]:
    """95 % interval of the median: percentile bootstrap over the values (Efron 1979), the same at every call.

    A bound is infinite where a lost episode decides it; both are NaN without values. NaNs are ignored.
    """
    said = np.sort(given_in(values))
    if said.size == 0:
        return float("nan"), float("nan")
    medians = np.sort(said[_middles(said.size)].mean(axis=1))
    tail = (1 - LEVEL) / 2
    # Without interpolation, which has no meaning between a number and infinity.
    return float(medians[int(tail * RESAMPLES)]), float(medians[int(np.ceil((1 - tail) * RESAMPLES)) - 1])


def paired_ratios(mine: ArrayLike, reference: ArrayLike) -> Array:
    """Magnitudes of ``mine`` (N,) over those of ``reference`` (N,), episode by episode.

    Equal ones give 1, two lost episodes and two zeros among them; NaN where either says nothing.
    """
    above, below = np.abs(np.asarray(mine, dtype=np.float64)), np.abs(np.asarray(reference, dtype=np.float64))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(above == below, 1.0, above / below)


def summary_with_interval(values: ArrayLike) -> dict[str, Any]:
    """``median`` with its interval ``low`` and ``high``, ``q95``, ``worst`` and ``count`` of the sizes of ``values``."""
    size = np.abs(given_in(values))
    low, high = median_interval(size)
    return {
        "median": quantile(size, 0.5), "low": low, "high": high,
        "q95": quantile(size, 0.95), "worst": quantile(size, 1.0), "count": int(size.size),
    }  # fmt: skip
