"""What a fit cannot say because its model lacks the form: what the log shows of it, by one step of the fit.

Two kinds are looked for. Some have a number that the model knows but takes for none (``free_parameters.shown_by``): friction
that depends on the way of motion, hysteresis of the valves, exhaust edges unlike those to the supply. Where the log shows them
they are identified as well. A supply that sags is another model: it is named, and the owner's file may have its line.
"""

from dataclasses import dataclass

import numpy as np

from baselines.identification.fit.estimate import Fit
from baselines.identification.fit.free_parameters import FreeParameter, coordinates, rig_at
from baselines.identification.fit.one_step import one_step
from baselines.identification.windows.starts import predicted
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import DECLARED, Parameters

PART = 0.25
"""Of the owner's spread: step of the difference along a form. A play of the valves needs more than the noise of commands."""

SURE, LEAST = 4.0, 0.1
"""Standard deviations, and part of the owner's spread, from which a form is there; assumed."""

SAGS, PLAIN = 1e3, 25.0
"""Pa by which the supply varies from window to window where that is named, and by how much the sum of squared residuals of a
window, over their noise, then falls in the mean: a supply line makes it 60 to 120, friction of another law 10; assumed."""


@dataclass(frozen=True)
class Suspect:
    """A form that the log shows and the model lacks, in ``words``; by its ``gain`` the sum of squared residuals, over their
    noise, would fall with it."""

    words: str
    gain: float


def shown(fit: Fit, forms: tuple[FreeParameter, ...]) -> dict[str, float]:
    """Those of ``forms`` that the log shows, with the values that one step says."""
    if not forms:
        return {}
    at = coordinates(fit.rig, forms)
    spread = np.array([one.prior.spread for one in forms])
    moved = [rig_at(fit.rig, (one,), np.array([place + PART * one.prior.spread])) for one, place in zip(forms, at, strict=True)]
    found = one_step(fit, _columns(fit, fit.problem.offsets.corrected(), moved) / (PART * spread))
    values = {}
    for one, place, step, deviation in zip(forms, at, found.value, found.deviation, strict=True):
        value = one.prior.value(float(place + step))
        if abs(step) > max(SURE * deviation, LEAST * one.prior.spread) and value > DECLARED[one.name].least:
            values[one.name] = value
    return values


def _columns(fit: Fit, windows: Windows, rigs: list[Parameters]) -> Array:
    """How residuals (W, R + F, C) change from the fit's rig to ``rigs``."""
    free, residual = fit.problem.settled(fit.theta)
    found = predicted(windows, fit.problem.noise, rigs, np.repeat(free[None], len(rigs), axis=0))
    return np.asarray((found - residual).transpose(1, 2, 0))


def suspects(fit: Fit) -> list[Suspect]:
    """Other forms that the log shows: a supply whose pressure is another one in every window.

    It is the scatter of the pressures that fit each window best.
    """
    problem = fit.problem
    rig = fit.rig.replace({"air.supply_pressure": fit.rig.air.supply_pressure + SAGS})
    slopes = problem.slopes.unexplained(_columns(fit, problem.offsets.corrected(), [rig]) / SAGS)[..., 0]
    residual = problem.settled(fit.theta)[1]
    weights = np.maximum(np.sum(slopes**2, axis=1), 1e-300)
    own = -np.sum(slopes * residual, axis=1) / weights
    own -= np.average(own, weights=weights)
    count, surplus = len(own), float(np.sum(own**2 * weights)) - (len(own) - 1)
    scatter = max(surplus, 0.0) / float(weights.sum() - np.sum(weights**2) / weights.sum())
    if surplus < PLAIN * count or scatter**0.5 < SAGS:
        return []
    words = (
        f"the supply's pressure varies by {scatter**0.5:.2g} Pa from window to window: a line or a reservoir that is too small "
        "(air.supply_conductance, air.supply_volume), a regulator that lags"
    )
    return [Suspect(words, surplus)]
