"""A rig from a trial: the parameters under which the predictions of its windows differ least from what was measured.

SciPy's ``least_squares`` sees the parameters alone (``problem``). A first search takes short windows, and begins at the owner's
rig and at the best of many drawn ones; a second one takes all of the trial.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from baselines.identification.fit.beginnings import SHORT, best_drawn, spread_out
from baselines.identification.fit.budget import UnsettledError
from baselines.identification.fit.free_parameters import FREE_PARAMETERS, FreeParameter, coordinates
from baselines.identification.fit.problem import Problem, Tick
from baselines.identification.log.trial import Trial
from baselines.identification.windows.noise import guessed_noise, is_fitting, noise_from
from baselines.identification.windows.starts import Noise, outliers
from baselines.identification.windows.windows import cut
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

MOST = (25, 30)
"""Evaluations of the first and of the second search at most."""

TOLERANCE = 1e-7
"""A search ends where a step lowers the cost, or moves the coordinates, by less than this fraction. The cost is some 3e4, of
which 0.5 is a standard deviation: where friction hardly falls near rest the valley is flat, and 1e-5 would end half way."""

GOOD = 1.1
"""Residuals over the noise of neighbouring samples; up to this ratio a search has found the rig, and none begins elsewhere."""

BEGINNING = 0.4
"""Fraction of the remaining budget that each of the first searches may take, so that one that goes astray leaves the rest."""

MOVED, MOST_ROUNDS = 0.05, 3
"""A search is repeated where the noise changes by more than this, or the latency by half a period; at most so often."""

MOST_WEIGHTS = 3
"""How often a search is repeated at most with new weights (``robust``)."""


@dataclass(frozen=True)
class Fit:
    """Coordinates (Q,) that fit best, in a rig, with the problem that they solve and its last Jacobian (M, Q).

    The search has ``ended`` where it has not merely come to the most evaluations that it may make.
    """

    free: tuple[FreeParameter, ...]
    theta: Array
    rig: Parameters
    problem: Problem
    jacobian: Array
    noise: Noise
    cost: float
    ended: bool = True

    def is_good(self, noise: Noise) -> bool:
        """Whether the residuals are no larger than this ``noise`` explains."""
        return self.noise.pressure < GOOD * noise.pressure and self.noise.position < GOOD * noise.position

    @property
    def covariance(self) -> Array:
        """Of the coordinates, (Q, Q), from the noise and the owner's spreads."""
        return np.asarray(np.linalg.inv(self.jacobian.T @ self.jacobian))


def search(problem: Problem, theta: Array, most: int, weights: int | None = None) -> Fit:
    """``least_squares`` from coordinates ``theta`` (Q,), with at most ``most`` evaluations. It is repeated while the weights
    change, at most ``weights`` times, or ``MOST_WEIGHTS``."""
    low, high = problem.limits
    place = np.clip(theta, low + 1e-6, high - 1e-6)
    with problem.explained():
        for left in reversed(range(weights or MOST_WEIGHTS)):
            if not np.isfinite(problem.residuals(place)).all():
                raise ValueError(problem.disagreement())
            try:
                found: OptimizeResult = least_squares(
                    problem.residuals,
                    place,
                    problem.jacobian,
                    bounds=(low, high),
                    x_scale=problem.spread,
                    max_nfev=most,
                    ftol=TOLERANCE,
                    xtol=TOLERANCE,
                )
            except UnsettledError:
                found = _so_far(problem)
                break
            except ValueError as error:  # derivatives that are no numbers, in SciPy's words
                raise ValueError(problem.disagreement()) from error
            place = np.clip(found.x, low + 1e-6, high - 1e-6)
            if not left or not problem.reweigh(found.x):
                break
        residual = problem.settled(found.x)[1]
        noise = noise_from(problem.windows, problem.noise, problem.slopes, residual)
    return Fit(problem.free, found.x, problem.rig_at(found.x), problem, found.jac, noise, float(found.cost), found.status > 0)


def _so_far(problem: Problem) -> OptimizeResult:
    """Where a search has come to whose budget is over; ``UnsettledError`` where it does not fit there."""
    if problem.last is None:
        raise UnsettledError
    theta, _ = problem.last
    _check_fits(problem, theta)
    jacobian, residuals = problem.jacobian(theta), problem.residuals(theta)
    return OptimizeResult(x=theta, jac=jacobian, cost=0.5 * float(residuals @ residuals), status=0)


def _check_fits(problem: Problem, theta: Array) -> None:
    """End the budget of a search that has come to ``theta``; ``UnsettledError`` where it does not fit there."""
    problem.windows.budget.over = True
    if not is_fitting(problem.windows, problem.settled(theta)[1]):
        raise UnsettledError


def fit(
    trial: Trial, owner: Parameters, seed: int = 0, free: tuple[FreeParameter, ...] = FREE_PARAMETERS, tick: Tick = lambda: None
) -> Fit:
    """The parameters of a trial's rig; ``owner`` is the rig as its owner describes it, ``seed`` draws where to begin."""
    return refine(trial, begin(trial, owner, seed, free, tick), owner, free, tick)


def begin(trial: Trial, owner: Parameters, seed: int, free: tuple[FreeParameter, ...], tick: Tick) -> Fit:
    """The first search, on a few short windows."""
    some = spread_out(cut(trial, owner, SHORT))
    problem = Problem(some, guessed_noise(trial), owner, free, tick)
    with problem.explained():
        drawn = best_drawn(problem, np.random.default_rng(seed))
    tried: list[Fit] = []
    failed: list[ValueError] = []
    for theta in (problem.centre, drawn):
        try:
            with some.budget.part(BEGINNING):
                tried.append(search(Problem(some, problem.noise, owner, free, tick), theta, MOST[0]))
        except ValueError as error:  # the other beginning may lead to the rig
            failed.append(error)
            continue
        if tried[-1].is_good(problem.noise):
            break
    if not tried:
        raise failed[0]
    return min(tried, key=lambda one: one.cost)


def refine(trial: Trial, first: Fit, owner: Parameters, free: tuple[FreeParameter, ...], tick: Tick = lambda: None) -> Fit:
    """The second search, with all of a trial, for ``free``, repeated while it moves noise or latency (``MOVED``)
    or leaves windows that fit worse than others.

    What is not among ``free`` has the owner's value. Where the budget ends, the fit is the one before.
    """
    found = first
    for _ in range(MOST_ROUNDS):
        if found.problem.windows.budget.over:
            break
        before = found
        problem = Problem(cut(trial, found.rig, budget=found.problem.windows.budget), found.noise, owner, free, tick)
        theta = coordinates(found.rig, free)
        with before.problem.explained():
            try:
                problem.begin_anew(found.rig, found.problem.offsets.sizes)
                problem.reweigh(theta)
                found = search(problem, theta, MOST[1])
            except (UnsettledError, ValueError):
                if problem.windows.budget.left > 0:
                    raise
                _check_fits(before.problem, before.theta)
                break
        if _is_close(before, found, trial.period) and not outliers(problem.settled(found.theta)[1]).any():
            break
    return found


def _is_close(before: Fit, found: Fit, period: float) -> bool:
    """Whether noise and latency are those with which a search was made."""
    late = abs(found.problem.windows.latency_of(found.rig) - found.problem.windows.latency_of(before.rig))
    pairs = ((found.noise.pressure, before.noise.pressure), (found.noise.position, before.noise.position))
    return late < 0.5 * period and all(abs(one / other - 1.0) < MOVED for one, other in pairs)
