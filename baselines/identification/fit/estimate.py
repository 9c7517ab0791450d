"""A rig from a trial: the parameters under which the predictions of its windows differ least from what was measured.

The residuals are those of measurements, over their noise, and of the owner's values, over their spreads (``free``). Start
states (``starts``) and what sensors add (``offsets``) are eliminated, so that SciPy's ``least_squares`` sees the parameters
alone. A first search takes short windows, and begins at the owner's rig and at the best of many drawn ones; a second one takes
all of the trial.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from baselines.identification.fit.beginnings import SHORT, best_drawn, spread_out
from baselines.identification.fit.budget import UnsettledError
from baselines.identification.fit.free_parameters import FREE_PARAMETERS, FreeParameter, coordinates, limits, rig_at
from baselines.identification.fit.robust import reweighted
from baselines.identification.log.trial import Trial
from baselines.identification.windows.noise import guessed_noise, is_fitting, noise_from
from baselines.identification.windows.offsets import Offsets
from baselines.identification.windows.starts import Noise, Slopes, begun_anew, outliers, predicted, settle, slopes_at
from baselines.identification.windows.windows import Windows, cut
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

MOST = (25, 30)
"""Evaluations of the first and of the second search at most."""

TOLERANCE = 1e-7
"""A search ends where a step lowers the cost, or moves the coordinates, by less than this fraction. The cost is some 3e4, of
which 0.5 is a standard deviation: where friction hardly falls near rest the valley is flat, and 1e-5 would end half way."""

GOOD = 1.1
"""Residuals over the noise of neighbouring samples up to which a search has found the rig, and does not begin elsewhere too."""

DIFFERENCE = 1e-5
"""Step of forward differences, in coordinates: rounding of the residuals, 1e-9, leaves 1e-4 of a derivative."""

MOVED, MOST_ROUNDS = 0.05, 3
"""A search is repeated where noise moves by more than this fraction, or the latency by half a period; so many at most."""

STILL, MOST_STEPS = 0.1, 6
"""Where offsets move by less than so many standard deviations an evaluation ends; steps at most."""

MOST_WEIGHTS = 3
"""Times that a search is repeated with new weights (``robust``) at most."""

NAMED = 3
"""Windows that are named where a search fails."""

Tick = Callable[[], object]


class Problem:
    """Residuals over coordinates (Q,) of ``free`` and their derivatives, with start states that fit best.

    ``owner`` is the rig as its owner describes it, which gives what is not identified, the centre of the spreads and the limits
    (Q,) of the search; ``tick`` is called at every evaluation.
    """

    def __init__(self, windows: Windows, noise: Noise, owner: Parameters, free: tuple[FreeParameter, ...], tick: Tick) -> None:
        self.noise, self.free, self._owner, self._tick = noise, free, owner, tick
        self.centre, self.limits = coordinates(owner, free), limits(owner, free)
        self.spread: Array = np.array([one.prior.spread for one in free])
        self._start: Array = np.zeros((len(windows.starts), len(windows.free)))
        self._at: tuple[bytes, Array, Array, Array]
        self._slopes: Slopes | None
        self._take(windows)
        self._columns = windows.length * 4 + windows.positions.shape[1] * 2 + len(windows.free)
        self.derivatives: Array = np.empty(0)
        self.last: tuple[Array, Array] | None = None

    @property
    def slopes(self) -> Slopes:
        """Those that the start states at the last coordinates were sought with."""
        assert self._slopes is not None, "coordinates were settled"
        return self._slopes

    def rig_at(self, theta: Array) -> Parameters:
        """The rig at coordinates (Q,)."""
        return rig_at(self._owner, self.free, theta)

    def begin_anew(self, rig: Parameters, sizes: Array) -> None:
        """Begin at the start states that fit a rig and offsets of ``sizes`` best, also where the guess does not lead there."""
        self.offsets.sizes = sizes
        self._start = begun_anew(self.offsets.corrected(), self.noise, rig, self._start)

    def settled(self, theta: Array) -> tuple[Array, Array]:
        """Start states (W, F) and residuals (W, R + F) at coordinates (Q,); NaN where the rig predicts no numbers."""
        if self._at[0] != theta.tobytes():
            self._tick()
            before = self.offsets.sizes
            try:
                free, residual, sizes = self._settled(self.rig_at(theta))
            except np.linalg.LinAlgError:
                free, residual, sizes = self._start, np.full((len(self._start), self._columns), np.nan), before
            self.offsets.sizes = sizes
            self._at = theta.tobytes(), free, residual, sizes
        return self._at[1:3]

    def _settled(self, rig: Parameters) -> tuple[Array, Array, Array]:
        """Start states, residuals and sizes of the offsets that fit a rig best."""
        slopes, free, residual = self._slopes or self._linearize(rig), self._start, np.empty(0)
        least, sizes = np.inf, self.offsets.sizes
        for _ in range(MOST_STEPS):
            tried = settle(self.offsets.corrected(), self.noise, rig, free, slopes)
            cost = float(np.sum(tried[1] ** 2) + np.sum(self.offsets.sizes**2))
            if cost < least or not np.isfinite(least):
                least, sizes, (free, residual) = cost, self.offsets.sizes, tried
                if not self.offsets.step(residual) >= STILL:
                    break
            else:
                self.offsets.sizes = 0.5 * (self.offsets.sizes + sizes)
        return free, residual, sizes

    def reweigh(self, theta: Array) -> bool:
        """Give measurements the weights that their residuals at coordinates (Q,) ask for; whether these are others."""
        windows = reweighted(self.windows, self.settled(theta)[1])
        if windows is None:
            return False
        self._start, sizes = self._at[1], self.offsets.sizes
        self._take(windows)
        self.offsets.sizes = sizes
        return True

    def _take(self, windows: Windows) -> None:
        self.windows, self.offsets = windows, Offsets(windows, self.noise, self._owner)
        self._at, self._slopes = (b"", self._start, self._start, self._start), None

    @contextmanager
    def explained(self) -> Iterator[None]:
        """Where the numbers of a search break down, or its budget ends, a ``ValueError`` names where log and model disagree."""
        try:
            with np.errstate(all="ignore"):
                yield
        except (np.linalg.LinAlgError, UnsettledError) as error:
            raise ValueError(self.disagreement()) from error

    def disagreement(self) -> str:
        """Where log and model disagree, in words, and what may be the cause."""
        costs = np.sum(self._at[2] ** 2, axis=1)
        worst = np.argsort(np.where(np.isfinite(costs), costs, np.inf))[::-1][:NAMED]
        times, trial = self.windows.trial.times, self.windows.trial
        length = trial.period * self.windows.length
        stretches = [f"{times[first]:.4g} to {times[first] + length:.4g} s" for first in np.sort(self.windows.starts[worst])]
        return (
            "the log and the model of the rig disagree so much that no parameters are found, most of all in "
            f"{', '.join(stretches)}; allowed: columns in their places and units, sensors that hold, a rig (--parameters) near "
            "the laboratory's"
        )

    def residuals(self, theta: Array) -> Array:
        """All residuals, (W (R + F) + E + Q,)."""
        return np.concatenate([self.settled(theta)[1].ravel(), self._at[3], (theta - self.centre) / self.spread])

    def jacobian(self, theta: Array) -> Array:
        """Their derivatives, (W (R + F) + E + Q, Q), less what start states and offsets make up for: one lane a parameter and
        window."""
        self._start, residual = self.settled(theta)
        slopes = self._linearize(self.rig_at(theta))
        moved = theta + DIFFERENCE * np.eye(len(theta))
        rigs = [self.rig_at(one) for one in moved]
        found = predicted(self.offsets.corrected(), self.noise, rigs, np.repeat(self._start[None], len(rigs), axis=0))
        own = slopes.unexplained(((found - residual) / DIFFERENCE).transpose(1, 2, 0))
        self.derivatives, bent = self.offsets.unexplained(own)
        found = np.concatenate([self.derivatives.reshape(-1, len(theta)), bent, np.diag(1.0 / self.spread)])
        self.last = theta.copy(), found
        return found

    def _linearize(self, rig: Parameters) -> Slopes:
        self._slopes = slopes_at(self.windows, self.noise, rig, self._start)
        self.offsets.linearize(self._slopes)
        return self._slopes


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
        """Whether the residuals are not more than a ``noise`` leaves."""
        return self.noise.pressure < GOOD * noise.pressure and self.noise.position < GOOD * noise.position

    @property
    def covariance(self) -> Array:
        """Of the coordinates, (Q, Q), from the noise and the owner's spreads."""
        return np.asarray(np.linalg.inv(self.jacobian.T @ self.jacobian))


def search(problem: Problem, theta: Array, most: int) -> Fit:
    """``least_squares`` from coordinates ``theta`` (Q,) on, with at most ``most`` evaluations, again while weights change."""
    low, high = problem.limits
    place = np.clip(theta, low + 1e-6, high - 1e-6)
    with problem.explained():
        for left in reversed(range(MOST_WEIGHTS)):
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
    some = spread_out(cut(trial, owner, SHORT))
    problem = Problem(some, guessed_noise(trial), owner, free, tick)
    with problem.explained():
        drawn = best_drawn(problem, np.random.default_rng(seed))
    tried = []
    for theta in (problem.centre, drawn):
        tried.append(search(Problem(some, problem.noise, owner, free, tick), theta, MOST[0]))
        if tried[-1].is_good(problem.noise):
            break
    return refine(trial, min(tried, key=lambda one: one.cost), owner, free, tick)


def refine(trial: Trial, first: Fit, owner: Parameters, free: tuple[FreeParameter, ...], tick: Tick = lambda: None) -> Fit:
    """The second search, with all of a trial, for ``free``, repeated while it moves noise or latency (``MOVED``)
    or leaves windows that fit worse than others.

    What is not among ``free`` has the owner's value. Where the budget is over, the fit is the ``first`` one.
    """
    found = first
    for _ in range(MOST_ROUNDS):
        if found.problem.windows.budget.over:
            break
        before = found
        problem = Problem(cut(trial, found.rig, budget=found.problem.windows.budget), found.noise, owner, free, tick)
        theta = coordinates(found.rig, free)
        with found.problem.explained():
            try:
                problem.begin_anew(found.rig, found.problem.offsets.sizes)
                problem.reweigh(theta)
            except UnsettledError:
                _check_fits(found.problem, found.theta)
                break
        found = search(problem, theta, MOST[1])
        if _is_close(before, found, trial.period) and not outliers(problem.settled(found.theta)[1]).any():
            break
    return found


def _is_close(before: Fit, found: Fit, period: float) -> bool:
    """Whether noise and latency are those with which a search was made."""
    late = abs(found.problem.windows.latency_of(found.rig) - found.problem.windows.latency_of(before.rig))
    pairs = ((found.noise.pressure, before.noise.pressure), (found.noise.position, before.noise.position))
    return late < 0.5 * period and all(abs(one / other - 1.0) < MOVED for one, other in pairs)
