"""Weights of measurements, so that a few wrong ones that no check of rows has found do not bend a fit.

A residual beyond ``LIMIT`` robust standard deviations counts with the square of the limit over its size: the further out, the
less it pulls. Noise alone does not get there, so that a log without outliers is fitted by least squares as it is.
"""

from dataclasses import replace

import numpy as np

from baselines.identification.windows.noise import GAUSS
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array

LIMIT = 6.0
"""Standard deviations; of 1e8 normal numbers one is further out."""

CHANGED = 0.05
"""Where no weight changes by more than this a search has been made with the right ones."""


def reweighted(windows: Windows, residual: Array) -> Windows | None:
    """The windows with weights for residuals (W, R + 14) under their present ones; None where these are right."""
    count, cells = len(residual), windows.length * 4
    seen = np.repeat(windows.position_weights[..., None], 2, axis=2)
    last = cells + seen.shape[1] * 2
    pressure = _weights(residual[:, :cells].reshape(windows.pressure_weights.shape), windows.pressure_weights)
    position = _weights(residual[:, cells:last].reshape(count, -1, 2), seen).min(axis=2)
    moved = max(np.abs(pressure - windows.pressure_weights).max(), np.abs(position - windows.position_weights).max())
    return replace(windows, pressure_weights=pressure, position_weights=position) if moved > CHANGED else None


def _weights(residual: Array, weights: Array) -> Array:
    """Factors of residuals that are shown with factors ``weights``."""
    known = weights > 0
    sizes = np.abs(residual) / np.where(known, weights, 1.0)
    most = LIMIT * max(1.0, GAUSS * float(np.median(sizes[known]))) if known.any() else LIMIT
    return np.where(known, np.minimum(1.0, most / np.maximum(sizes, 1e-300)), 0.0)
