"""How well a fit knows its parameters, and what it cannot tell.

Two standard deviations of every coordinate are worked out. One is that of the noise, from (J'J)^-1. The other comes from the
scores s = J'r of the windows, (J'J)^-1 (sum of s s') (J'J)^-1: it also grows where the model misses something that lasts longer
than a sample (White, Econometrica 1982, with windows in the place of observations). The larger one counts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.identification.fit.estimate import Fit
from birthsim_env.physics.compiled.lanes import Array

DETERMINED = 0.5
"""A log determines a parameter where it makes the standard deviation less than this fraction of the owner's spread; assumed."""

NORMAL = 1.959964
"""Standard deviations on either side of a 95 % interval."""

NAMED = 0.3
"""Least component of a direction that is named."""


@dataclass(frozen=True)
class Direction:
    """A combination of parameters: ``parts`` (name, component), and the standard deviation along it in owner's spreads."""

    parts: tuple[tuple[str, float], ...]
    deviation: float


@dataclass(frozen=True)
class Certainty:
    """Standard deviations ``noise``, ``windows`` and ``deviation``, the larger, of coordinates (Q,); whether the log has
    ``determined`` a parameter (Q,); the ``weakest`` directions, worst first."""

    noise: Array
    windows: Array
    deviation: Array
    determined: NDArray[np.bool_]
    weakest: tuple[Direction, ...]


def certainty_of(fit: Fit) -> Certainty:
    """What is known of a fit's coordinates."""
    covariance = fit.covariance
    noise = np.sqrt(np.diag(covariance))
    windows = np.sqrt(np.diag(covariance @ _scores(fit) @ covariance))
    spread = fit.problem.spread
    deviation = np.maximum(noise, windows)
    # Singular values of the scaled Jacobian, from those of its inverse square.
    values, vectors = np.linalg.eigh(covariance / np.outer(spread, spread))
    weakest = tuple(_direction(fit, vectors[:, k], float(values[k]) ** 0.5) for k in np.argsort(values)[::-1][:3])
    return Certainty(noise, windows, deviation, deviation < DETERMINED * spread, weakest)


def _scores(fit: Fit) -> Array:
    return score_products(fit.problem.settled(fit.theta)[1], fit.problem.derivatives)


def score_products(residual: Array, derivatives: Array) -> Array:
    """The sum of s s' (Q, Q) over windows, s = J'r, for residuals (W, R) with ``derivatives`` (W, R, Q)."""
    scores = np.einsum("wrq,wr->wq", derivatives, residual)
    return np.asarray(scores.T @ scores)


def _direction(fit: Fit, vector: Array, deviation: float) -> Direction:
    largest = vector[int(np.argmax(np.abs(vector)))]
    signed = vector * np.sign(largest)
    order = np.argsort(np.abs(signed))[::-1]
    parts = tuple((fit.problem.free[k].name, float(signed[k])) for k in order if abs(signed[k]) >= NAMED)
    return Direction(parts, deviation)
