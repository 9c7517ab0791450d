"""Statistics over episodes, in which a lost episode is infinitely bad, or as bad as ``LOST_ERROR`` where errors are pooled.

An episode that ends early has figures only up to its end, and those may well be good ones. So that a controller gains
nothing by losing an episode, every figure of a lost episode counts as infinite: medians and quantiles that lean on one are
infinite too, and print as "lost". NaN is an episode that says nothing about a metric; it counts nowhere.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from birthsim_env.physics.compiled.lanes import Array

RESAMPLES = 9999
"""Bootstrap samples of an interval: 0.2 % of the interval's width in error."""

LEVEL = 0.95
"""Confidence of the intervals."""

LOST_ERROR = 100.0
"""mm: what a lost lane counts as where errors are pooled, in means and sums of squares, which infinity would make infinite."""


def penalize_lost(values: ArrayLike, lost: ArrayLike, applies: bool | None = None, penalty: float = np.inf) -> Array:
    """``values`` with ``penalty`` where ``lost``, of the same shape, unless the metric does not apply: then as they are.

    ``applies`` None means: if any of the values is finite.
    """
    given = np.asarray(values, dtype=np.float64)
    if applies is None:
        applies = bool(np.isfinite(given).any())
    return np.where(np.asarray(lost, dtype=np.bool_), penalty, given) if applies else given


def quantile(values: ArrayLike, fraction: float) -> float:
    """Quantile by linear interpolation; infinite where it leans on an infinite value, NaN without values. NaNs are ignored."""
    said = np.sort(_said(values))
    if said.size == 0:
        return float("nan")
    place = fraction * (said.size - 1)
    low, high = said[int(np.floor(place))], said[int(np.ceil(place))]
    return float(high) if low == high or not np.isfinite(high) else float(low + (place - np.floor(place)) * (high - low))


def summarize(values: ArrayLike) -> dict[str, float]:
    """Median, mean, 95 % quantile and maximum, the latter two of the sizes; NaNs are ignored, and the answer to no value."""
    said = _said(values)
    return {
        "median": quantile(said, 0.5),
        "mean": float(np.mean(said)) if said.size else float("nan"),
        "q95": quantile(np.abs(said), 0.95),
        "max": quantile(np.abs(said), 1.0),
    }


@cache
def _middles(count: int) -> NDArray[np.intp]:
    """Ranks (RESAMPLES, 2) of the two middle values in resamples of ``count`` sorted values, from a fixed seed."""
    ranks = np.sort(np.random.default_rng(count).integers(count, size=(RESAMPLES, count)), axis=1)
    return ranks[:, [(count - 1) // 2, count // 2]]


def median_interval(values: ArrayLike) -> tuple[float, float]:
    """95 % interval of the median: percentile bootstrap over the values (Efron 1979), the same at every call.

    A bound is infinite where a lost episode decides it; both are NaN without values. NaNs are ignored.
    """
    said = np.sort(_said(values))
    if said.size == 0:
        return float("nan"), float("nan")
    medians = np.sort(said[_middles(said.size)].mean(axis=1))
    tail = (1 - LEVEL) / 2
    # Without interpolation, which has no meaning between a number and infinity.
    return float(medians[int(tail * RESAMPLES)]), float(medians[int(np.ceil((1 - tail) * RESAMPLES)) - 1])


def interquartile_mean(values: ArrayLike) -> float:
    """Mean of the middle half of the values, those at its edges by their fraction (Agarwal et al. 2021); NaNs are ignored.

    Infinite where a lost episode falls into the middle half, NaN without values.
    """
    said = np.sort(_said(values))
    if said.size == 0:
        return float("nan")
    edges = np.clip(np.arange(said.size + 1), said.size / 4, 3 * said.size / 4)
    weights = np.diff(edges)
    return float(said[weights > 0] @ weights[weights > 0] / weights.sum())


def crossed_interval(statistic: Callable[[Array], float], values: ArrayLike, resamples: int = 2000) -> tuple[float, float]:
    """95 % interval of ``statistic`` of ``values`` (seeds, episodes): percentile bootstrap that draws training seeds and
    episodes anew, both with replacement, since both are a sample. The same at every call.
    """
    given = np.asarray(values, dtype=np.float64)
    rng = np.random.default_rng(given.shape)
    drawn = np.empty(resamples)
    for k in range(resamples):
        seeds, episodes = (rng.integers(count, size=count) for count in given.shape[:2])
        drawn[k] = statistic(given[seeds][:, episodes])
    tail = (1 - LEVEL) / 2
    drawn.sort()
    return float(drawn[int(tail * resamples)]), float(drawn[int(np.ceil((1 - tail) * resamples)) - 1])


def paired_ratios(mine: ArrayLike, reference: ArrayLike) -> Array:
    """Magnitudes of ``mine`` (N,) over those of ``reference`` (N,), episode by episode.

    Equal ones give 1, two lost episodes and two zeros among them; NaN where either says nothing.
    """
    above, below = np.abs(np.asarray(mine, dtype=np.float64)), np.abs(np.asarray(reference, dtype=np.float64))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(above == below, 1.0, above / below)


def summary_with_interval(values: ArrayLike) -> dict[str, Any]:
    """``median`` with its interval ``low`` and ``high``, ``q95``, ``worst`` and ``count`` of the sizes of ``values``."""
    size = np.abs(_said(values))
    low, high = median_interval(size)
    return {
        "median": quantile(size, 0.5), "low": low, "high": high,
        "q95": quantile(size, 0.95), "worst": quantile(size, 1.0), "count": int(size.size),
    }  # fmt: skip


def _said(values: ArrayLike) -> Array:
    given = np.asarray(values, dtype=np.float64)
    return given[~np.isnan(given)]


def number(value: float) -> str:
    """A figure for a table: three digits, "lost" for infinity, "-" for nothing."""
    if np.isnan(value):
        return "-"
    return "lost" if np.isinf(value) else f"{value:.3g}"


def jsonable(content: Any) -> Any:
    """``content`` for JSON, which has no infinity: "lost" in its place, at any depth."""
    if isinstance(content, dict):
        return {name: jsonable(value) for name, value in content.items()}
    if isinstance(content, list):
        return [jsonable(value) for value in content]
    return "lost" if isinstance(content, float) and np.isinf(content) else content
