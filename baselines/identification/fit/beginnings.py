"""Where the first search of an identification begins: on a few short windows of the log, at the best of many drawn rigs."""

from typing import TYPE_CHECKING

import numpy as np

from baselines.identification.windows.starts import predicted, slopes_at
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array

if TYPE_CHECKING:
    from baselines.identification.fit.problem import Problem

SHORT, SOME = 0.1, 24
"""s and number of the windows of the first search, assumed."""

DRAWN = 48
"""Rigs that are drawn to begin the first search at, assumed."""


def spread_out(windows: Windows) -> Windows:
    """``SOME`` of the windows, all over the log."""
    count = len(windows.starts)
    return windows.some(np.unique(np.linspace(0, count - 1, min(SOME, count)).round().astype(np.intp)))


def best_drawn(problem: "Problem", rng: np.random.Generator) -> Array:
    """The best of ``DRAWN`` coordinates (Q,), all side by side as lanes, where start states give way as they do under the
    owner's rig."""
    windows, count = problem.windows, len(problem.centre)
    thetas = np.clip(problem.centre + problem.spread * rng.normal(size=(DRAWN, count)), *problem.limits)
    free = np.zeros((len(windows.starts), len(windows.free)))
    slopes = slopes_at(windows, problem.noise, problem.rig_at(problem.centre), free)
    rigs = [problem.rig_at(theta) for theta in thetas]
    found = predicted(windows, problem.noise, rigs, np.repeat(free[None], DRAWN, axis=0))
    # The median over windows: one in which a wrong latency hides the rest does not decide.
    costs = np.median(np.sum(slopes.unexplained(found.transpose(1, 2, 0)) ** 2, axis=1), axis=0)
    return np.asarray(thetas[int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))])
