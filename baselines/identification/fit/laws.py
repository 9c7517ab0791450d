"""Which friction law a log supports: the fit of each law is judged by windows that did not guide it.

Of a fit with Jacobian J and residuals r, of which D and d are the rows of one window, all other windows ask for
    step = -(J'J - D'D)^-1 (J'r - D'd)
so that d + D step is what the window shows of a fit that has not seen it. For a linear model that is exact (Allen,
Technometrics 1974, with windows in the place of observations), and one fit a law serves for all windows. A window's score is
the logarithm of how likely it is then, with its start state integrated out (Laplace's method):
    score = -|d + D step|^2 / 2 - log det(triangle of its start state)

Laws have unlike numbers of parameters and none contains another, so that tests of nested models do not apply; a score of what
was left out needs no count of parameters. The probability that a law predicts further windows best is the share of Bayesian
bootstraps of the windows (Rubin, Annals of Statistics 1981) in which its mean score is the largest (Yao, Vehtari, Simpson and
Gelman, Bayesian Analysis 2018). It takes from the windows how much scores scatter, and not from the noise, so that what no law
explains makes all of them less sure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from baselines.identification.fit.budget import Budget
from baselines.identification.fit.estimate import Fit, begin, refine, search
from baselines.identification.fit.free_parameters import FreeParameter, coordinates
from baselines.identification.fit.problem import Problem, Tick
from baselines.identification.log.trial import Trial
from baselines.identification.windows.windows import cut
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of

LAW = "friction.law"

LAWS: tuple[str, ...] = DECLARED[LAW].choices
"""The laws that the plant knows."""

SLOW = ("gms",)
"""Laws whose searches take some ten times as long as others': fitted where the owner's rig has one, or where asked for."""

COMPARED = tuple(law for law in LAWS if law not in SLOW)

BELIEVED = "lugre"
"""The law whose presliding controllers believe, whatever the file of a rig says."""

EVALUATIONS, MORE = 3, 6
"""Evaluations of a law's search before laws are compared, and further ones of those that these do not tell apart; assumed."""

SHARE = 0.5
"""Of the budget that is left, what the search of one law may take."""

SURE = 0.99
"""Probability from which a law is told from the others; assumed."""

BOOTSTRAPS = 10_000


@dataclass(frozen=True)
class Laws:
    """The law that the ``owner`` has, the one that was ``chosen``, and the probability of each that it predicts further windows
    best, ``chances``, by a number of ``windows``; empty where no laws were compared."""

    owner: str
    chosen: str
    chances: Mapping[str, float]
    windows: int

    @property
    def rivals(self) -> tuple[str, ...]:
        """Laws that cannot be told from the chosen one, the likeliest first."""
        found = [law for law, chance in self.chances.items() if law != self.chosen and chance > 1.0 - SURE]
        return tuple(sorted(found, key=lambda law: -self.chances[law]))

    def words(self) -> list[str]:
        """The law, how sure it is, and what controllers make of it, a line each."""
        unlike = (
            f"controllers believe the presliding of {BELIEVED}, whatever {LAW} is: without a force sensor they render "
            "stiffness less exactly on this rig"
        )
        return [self._choice(), *([unlike] if self.chosen != BELIEVED else [])]

    def _choice(self) -> str:
        if not self.chances:
            return f"{LAW} = {self.chosen}, as given: no other law was tried"
        worse = [law for law in self.chances if law != self.chosen and law not in self.rivals]
        behind = f"{_listed(worse)} {'predicts' if len(worse) == 1 else 'predict'} windows that guided no fit less well"
        chance = self.chances[self.chosen]
        if not self.rivals:
            sure = "above 0.999" if chance > 0.999 else f"{chance:.3f}"
            return f"{LAW} = {self.chosen}, probability {sure}: {behind} ({self.windows} windows); was {self.owner}"
        told = ", ".join(f"{law} {self.chances[law]:.2f}" for law in (self.chosen, *self.rivals))
        how = "KEPT" if self.chosen == self.owner else f"the likeliest; was {self.owner}"
        return f"{LAW} = {self.chosen}, {how}: the log cannot tell {told} apart{f'; {behind}' if worse else ''}"

    def others(self) -> str:
        """Which friction a rig may have that the chosen law does not fit."""
        if not self.chances:
            return "another law of friction"
        untried = ", ".join(f"--friction-law {law}" for law in SLOW)
        return f"another law of friction (none of {_listed(list(self.chances))} fits; not tried: {untried})"


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


class _Compared:
    """Searches of several laws on the same windows with the same noise and weights, and their ``scores`` (W,) by law."""

    def __init__(self, trial: Trial, first: Fit, owner: Parameters, tick: Tick) -> None:
        self._trial, self._first, self._owner, self._tick = trial, first, owner, tick
        self.fits: dict[str, Fit] = {}
        self.scores: dict[str, Array] = {}
        self.failed: list[ValueError] = []

    def add(self, law: str, start: Fit, weights: int | None = 1) -> None:
        """Search from another fit on under ``law``, which is left out where it comes to no end."""
        first, other = self._first, next(iter(self.fits.values()), None)
        try:
            rig, begun, owner = (one.replace({LAW: law}) for one in (first.rig, start.rig, self._owner))
        except ValueError as error:  # no step of the integrator follows this rig under the law
            self.failed.append(error)
            return
        windows = cut(self._trial, rig, budget=first.problem.windows.budget)
        if other:
            given = other.problem.windows
            windows = replace(windows, pressure_weights=given.pressure_weights, position_weights=given.position_weights)
        problem = Problem(windows, first.noise, owner, start.free, self._tick)
        self._search(law, problem, coordinates(begun, start.free), EVALUATIONS, weights, (begun, start.problem.offsets.sizes))

    def go_on(self, law: str) -> None:
        """Search on under a law that is there."""
        self._search(law, self.fits[law].problem, self.fits[law].theta, MORE, 1, None)

    def _search(
        self, law: str, problem: Problem, theta: Array, most: int, weights: int | None, anew: tuple[Parameters, Array] | None
    ) -> None:
        try:
            with problem.windows.budget.part(SHARE), problem.explained():
                if anew:
                    problem.begin_anew(*anew)
                found = search(problem, theta, most, weights)
                self.scores[law], self.fits[law] = scores_of(found), found
        except ValueError as error:
            self.failed.append(error)

    def chances(self, seed: int) -> dict[str, float]:
        """The probability of each law."""
        return dict(zip(self.scores, chances_of(np.array(list(self.scores.values())), seed).tolist(), strict=True))


def scores_of(found: Fit) -> Array:
    """Score of each window (W,) by a fit that has not seen it."""
    problem, jacobian = found.problem, found.jacobian
    residual = problem.settled(found.theta)[1]
    every, gradient = jacobian.T @ jacobian, jacobian.T @ problem.residuals(found.theta)
    own = problem.derivatives
    steps = -np.linalg.solve(
        every - own.transpose(0, 2, 1) @ own, (gradient - np.einsum("wrq,wr->wq", own, residual))[..., None]
    )
    shown = residual + (own @ steps)[..., 0]
    volumes = np.sum(np.log(np.diagonal(problem.slopes.triangle, axis1=1, axis2=2)), axis=1)
    return np.asarray(-0.5 * np.sum(shown**2, axis=1) - volumes)


def chances_of(scores: Array, seed: int) -> Array:
    """The probability of each of L laws that it predicts further windows best, (L,), by scores (L, W)."""
    shares = np.random.default_rng(seed).dirichlet(np.ones(scores.shape[1]), BOOTSTRAPS)
    best = np.argmax(shares @ scores.T, axis=1)
    return np.bincount(best, minlength=len(scores)) / BOOTSTRAPS


def fit_law(
    trial: Trial, owner: Parameters, seed: int, free: tuple[FreeParameter, ...], tick: Tick, law: str | None = None
) -> tuple[Fit, Laws]:
    """The parameters of a trial's rig under the friction law that the trial supports best, or under ``law``; a rig whose owner
    has a law of ``SLOW`` is fitted under that.

    The owner's law is kept where the trial does not tell that it is another one. All laws begin where the first evaluations
    under the owner's lead, and only the chosen one is searched to its end. Comparing has a budget as large as the search's.
    """
    known = value_of(owner, LAW)
    if law or known in SLOW:
        asked = owner.replace({LAW: law or known})
        return refine(trial, begin(trial, asked, seed, free, tick), asked, free, tick), Laws(known, law or known, {}, 0)
    first = begin(trial, owner, seed, free, tick)
    first.problem.windows.budget.left += Budget.of(trial).left
    compared = _Compared(trial, first, owner, tick)
    compared.add(known, first, None)
    for other in COMPARED:
        if other != known:
            compared.add(other, compared.fits.get(known, first))
    if not compared.fits:
        raise compared.failed[0]
    laws = _told(compared, known, seed)
    begun = compared.fits[laws.chosen]
    return refine(trial, begun, owner.replace({LAW: laws.chosen}), free, tick), laws


def _told(compared: _Compared, known: str, seed: int) -> Laws:
    """What the laws' scores say, after further evaluations of those that the first ones do not tell apart."""
    chances = compared.chances(seed)
    near = [law for law, chance in chances.items() if chance > 1.0 - SURE]
    if len(near) > 1:
        for law in near:
            compared.go_on(law)
        chances = compared.chances(seed)
    chosen = known if chances.get(known, 0.0) > 1.0 - SURE else max(chances, key=lambda law: chances[law])
    return Laws(known, chosen, chances, len(compared.scores[chosen]))
