"""The start states of windows, eliminated: for given parameters each window begins where its measurements say.

A start state has F free numbers, 14 in the order of ``windows.FREE``, and more of a rig with options. They are found by
Gauss-Newton steps with what is known of them beforehand, ``Windows.spread`` about the guess, in the measurements' company: rows
of residuals over their standard deviations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.identification.windows.prediction import predict
from baselines.identification.windows.windows import BRISTLES, Windows
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

DIFFERENCE = 1e-4
"""Step of differences, in ``Windows.spread``."""

CLOSE = 1e-2
"""Where a step moves every window's start by less than this many standard deviations the search ends."""

SHRINKS = 0.5
"""A step longer than this fraction of the one before asks for new slopes."""

MOST_STEPS = 8

WORSE = 1.15
"""A window whose residuals are so many times the median is begun anew; of 1100 numbers chance makes 1.1."""


GROWING = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)
"""Fractions of a window on which a start is sought that is hard to find, one after another. Of 12 logs of a rail whose piston
slides slowly 7 had windows that were led astray by searches on whole windows, 2 by halves of halves, and 1 by these."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what is measured: pressures, Pa, and positions, m."""

    pressure: float
    position: float


def residuals(windows: Windows, noise: Noise, pressures: Array, positions: Array) -> Array:
    """Measured less predicted, over the noise, weighted, (V, W, R): pressures (V, W, K, 4), then positions (V, W, F, 2)."""
    shape = (*pressures.shape[:2], -1)
    first = windows.pressure_weights * (windows.pressures - pressures) / noise.pressure
    second = windows.position_weights[..., None] * (windows.positions - positions) / noise.position
    return np.concatenate([first.reshape(shape), second.reshape(shape)], axis=2)


def states_of(windows: Windows, rigs: list[Parameters], free: Array) -> Array:
    """Start states (S, V, W) of V rigs from free ones (V, W, F) in units of ``Windows.spread`` about the guess."""
    states = np.repeat(windows.state[:, None], len(free), axis=1)
    states[list(windows.free)] += (free * windows.spread).transpose(2, 0, 1)
    states[list(BRISTLES)] *= windows.stiffness / np.array([rig.friction.bristle_stiffness for rig in rigs])[:, None]
    return states


def predicted(windows: Windows, noise: Noise, rigs: list[Parameters], free: Array) -> Array:
    """Residuals (V, W, R + F) for V rigs and free start states (V, W, F)."""
    pressures, positions, _ = predict(windows, rigs, states_of(windows, rigs, free))
    return np.concatenate([residuals(windows, noise, pressures, positions), -free], axis=2)


@dataclass(frozen=True)
class Slopes:
    """How residuals (W, R + F) follow the free start states: an orthonormal basis (W, R + F, 14) of what these can explain,
    and a triangle (W, F, 14) with basis @ triangle the derivatives."""

    basis: Array
    triangle: Array

    def step(self, residual: Array) -> tuple[Array, Array]:
        """Gauss-Newton steps (W, F) for residuals (W, R + F), and their lengths (W,) in standard deviations."""
        along = self.explained(residual[..., None])
        step = np.asarray(-np.linalg.solve(self.triangle, along)[..., 0], dtype=np.float64)
        return step, np.asarray(np.linalg.norm(along[..., 0], axis=1))

    def some(self, chosen: NDArray[np.bool_]) -> Slopes:
        """Those of some windows (W,)."""
        return Slopes(self.basis[chosen], self.triangle[chosen])

    def explained(self, columns: Array) -> Array:
        """Coordinates (W, F, C) in the basis of columns (W, R + F, C)."""
        return np.asarray(self.basis.transpose(0, 2, 1) @ columns)

    def unexplained(self, columns: Array) -> Array:
        """What start states cannot explain of columns (W, R + F, C)."""
        return np.asarray(columns - self.basis @ self.explained(columns))


def slopes_at(windows: Windows, noise: Noise, rig: Parameters, free: Array) -> Slopes:
    """The slopes at start states ``free`` (W, F)."""
    count = len(windows.free)
    several = np.repeat(free[None], 1 + count, axis=0)
    several[1:] += DIFFERENCE * np.eye(count)[:, None]
    found = predicted(windows, noise, [rig] * (1 + count), several)
    slopes = np.ascontiguousarray((found[1:] - found[0]).transpose(1, 2, 0)) / DIFFERENCE
    # Cholesky's triangle is that of QR in a tenth of the time; the rows of the guess keep the matrix well conditioned.
    triangle = np.linalg.cholesky(slopes.transpose(0, 2, 1) @ slopes).transpose(0, 2, 1)
    basis = slopes @ np.linalg.inv(triangle)
    return Slopes(np.asarray(basis, dtype=np.float64), np.asarray(triangle, dtype=np.float64))


def settle(windows: Windows, noise: Noise, rig: Parameters, free: Array, slopes: Slopes | None) -> tuple[Array, Array]:
    """Start states (W, F) that fit best under a rig, and residuals (W, R + F) with them.

    The search goes on from ``free``, first with given ``slopes``. A window that a step does not make better takes a shorter
    one, and one whose steps do not shrink gets new slopes.
    """
    free, residual = free.copy(), predicted(windows, noise, [rig], free[None])[0]
    slopes = slopes or slopes_at(windows, noise, rig, free)
    left, part, scale = np.arange(len(free)), windows, np.ones(len(free))
    for _ in range(MOST_STEPS):
        step, length = slopes.step(residual[left])
        away = length > CLOSE
        if not away.any():
            break
        left, part, slopes, step, length = left[away], part.some(away), slopes.some(away), step[away], length[away]
        trial = free[left] + scale[left, None] * step
        found = predicted(part, noise, [rig], trial[None])[0]
        better = np.sum(found**2, axis=1) <= np.sum(residual[left] ** 2, axis=1)
        free[left[better]], residual[left[better]] = trial[better], found[better]
        scale[left] = np.where(better, np.minimum(1.0, 2.0 * scale[left]), 0.25 * scale[left])
        slow = ~(slopes.step(residual[left])[1] < SHRINKS * length)
        if slow.any():
            anew = slopes_at(part.some(slow), noise, rig, free[left[slow]])
            slopes.basis[slow], slopes.triangle[slow] = anew.basis, anew.triangle
    return free, residual


def outliers(residual: Array) -> NDArray[np.bool_]:
    """Windows (W,) whose residuals (W, R + F) are more than ``WORSE`` times those of the median window."""
    costs = np.sum(residual**2, axis=1)
    return np.asarray(~(costs <= WORSE * np.median(costs)))


def begun_anew(windows: Windows, noise: Noise, rig: Parameters, free: Array) -> Array:
    """Start states (W, F) that fit a rig at least as well as what ``free`` leads to.

    A guess from measurements may have a bristle bent the wrong way, from which no small step leads out: the pistons stick where
    they slid. The ``outliers`` are tried from where the window before ends and from the guess, first on the beginning of their
    window, over which pistons forget little of their start, then on more and more of it.
    """
    best, residual = settle(windows, noise, rig, free, None)
    costs = np.sum(residual**2, axis=1)
    bad = np.flatnonzero(outliers(residual))
    if not len(bad):
        return best
    _, _, ends = predict(windows, [rig], states_of(windows, [rig], best[None]))
    ends[list(BRISTLES)] *= rig.friction.bristle_stiffness / windows.stiffness
    before = (ends[:, 0] - np.roll(windows.state, -1, axis=1))[list(windows.free)] / windows.spread[:, None]
    tries = [np.nan_to_num(np.roll(before, 1, axis=1).T[bad]), np.zeros_like(best[bad])]
    part, found = windows.some(np.tile(bad, len(tries))), np.concatenate(tries)
    for fraction in GROWING:
        found, left = settle(part.beginning(round(fraction * windows.length)), noise, rig, found, None)
    cost = np.sum(left**2, axis=1).reshape(len(tries), -1)
    chosen, each = np.argmin(cost, axis=0), np.arange(len(bad))
    better = cost[chosen, each] < costs[bad]
    best[bad[better]] = found.reshape(len(tries), len(bad), -1)[chosen, each][better]
    return best
