"""What a search minimizes: residuals over coordinates, and their derivatives.

The residuals are those of measurements, over their noise, and of the owner's values, over their spreads (``free``). Start
states (``starts``) and what sensors add (``offsets``) are eliminated.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from baselines.identification.fit.budget import UnsettledError
from baselines.identification.fit.free_parameters import FreeParameter, coordinates, limits, rig_at
from baselines.identification.fit.robust import reweighted
from baselines.identification.windows.offsets import Offsets
from baselines.identification.windows.starts import Noise, Slopes, begun_anew, predicted, settle, slopes_at
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

DIFFERENCE = 1e-5
"""Step of forward differences, in coordinates: rounding of the residuals, 1e-9, leaves 1e-4 of a derivative."""

STILL, MOST_STEPS = 0.1, 6
"""Where offsets move by less than so many standard deviations an evaluation ends; steps at most."""

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
        self._at: tuple[bytes | None, Array, Array, Array]
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
        self._at, self._slopes = (None, *self._at[1:]), None

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
        self._at, self._slopes = (None, self._start, self._start, self._start), None

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
