"""Statistics over episodes, in which a lost episode is infinitely bad, or as bad as ``LOST_ERROR`` where errors are pooled.

An episode that ends early has metrics only up to its end, and those may well be good ones. So that a controller gains
nothing by losing an episode, every metric of a lost episode counts as infinite: medians and quantiles that lean on one are
infinite too, and print as "lost". NaN is an episode that says nothing about a metric; it counts nowhere.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.physics.compiled.lanes import Array

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
    said = np.sort(given_in(values))
    if said.size == 0:
        return float("nan")
    place = fraction * (said.size - 1)
    low, high = said[int(np.floor(place))], said[int(np.ceil(place))]
    return float(high) if low == high or not np.isfinite(high) else float(low + (place - np.floor(place)) * (high - low))


def summarize(values: ArrayLike) -> dict[str, float]:
    """Median, mean, 95 % quantile and maximum, the latter two of the sizes; NaNs are ignored, and the answer to no value."""
    said = given_in(values)
    return {
        "median": quantile(said, 0.5),
        "mean": float(np.mean(said)) if said.size else float("nan"),
        "q95": quantile(np.abs(said), 0.95),
        "max": quantile(np.abs(said), 1.0),
    }


def interquartile_mean(values: ArrayLike) -> float:
    """Mean of the middle half of the values, those at its edges by their fraction (Agarwal et al. 2021); NaNs are ignored.

    Infinite where a lost episode falls into the middle half, NaN without values.
    """
    said = np.sort(given_in(values))
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
    return _percentiles(drawn)


def stratified_interval(statistic: Callable[[Array], float], values: ArrayLike, resamples: int = 2000) -> tuple[float, float]:
    """95 % interval of ``statistic`` of ``values`` (tasks, runs): percentile bootstrap that draws the runs of each task anew,
    with replacement; tasks are no sample (Agarwal et al. 2021). The same at every call.
    """
    given = np.asarray(values, dtype=np.float64)
    rng, tasks = np.random.default_rng(given.shape), np.arange(given.shape[0])[:, None]
    drawn = (given[tasks, rng.integers(given.shape[1], size=given.shape)] for _ in range(resamples))
    return _percentiles(np.array([statistic(one) for one in drawn]))


def _percentiles(drawn: Array) -> tuple[float, float]:
    """The bounds between which ``LEVEL`` of the values lie."""
    resamples, tail = len(drawn), (1 - LEVEL) / 2
    drawn.sort()
    return float(drawn[int(tail * resamples)]), float(drawn[int(np.ceil((1 - tail) * resamples)) - 1])


def given_in(values: ArrayLike) -> Array:
    """The values that are numbers, not NaN."""
    given = np.asarray(values, dtype=np.float64)
    return given[~np.isnan(given)]


def number(value: float) -> str:
    """A number for a table: three digits, "lost" for infinity, "-" for nothing."""
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
