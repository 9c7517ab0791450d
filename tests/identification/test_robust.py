"""Searches on logs that no check of rows has cleaned: missing measurements, outliers, forces that were not logged, no end."""

import dataclasses
import itertools
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from baselines.identification.fit import estimate
from baselines.identification.fit.budget import Budget, UnsettledError
from baselines.identification.fit.estimate import Fit, search
from baselines.identification.fit.free_parameters import FREE_PARAMETERS, coordinates
from baselines.identification.fit.problem import Problem
from baselines.identification.log.trial import Trial
from baselines.identification.windows import starts
from baselines.identification.windows.force_offset import force_offset
from baselines.identification.windows.noise import guessed_noise
from baselines.identification.windows.windows import cut
from birthsim_env.physics.rig.parameters import value_of
from tests.identification.broken import scattered
from tests.identification.trials import OWNER, TRUE, part, trial

SOME = tuple(
    one for one in FREE_PARAMETERS if one.name in ("mechanics.mass", "valves.sonic_conductance", "valves.time_constant")
)
KNOWN = TRUE.replace({one.name: value_of(OWNER, one.name) for one in SOME})
CHOSEN = np.arange(3, 22, 4)


def problem(log: Trial, budget: Budget | None = None) -> Problem:
    windows = cut(log, KNOWN, 0.1, budget).some(CHOSEN)
    return Problem(windows, guessed_noise(log), KNOWN, SOME, lambda: None)


def found(log: Trial) -> Fit:
    return search(problem(log), coordinates(KNOWN, SOME), 20)


def spoiled(**changes: Callable[[np.ndarray], np.ndarray]) -> Trial:
    whole = part(trial(), 0, 2500)
    return dataclasses.replace(whole, **{name: change(getattr(whole, name)) for name, change in changes.items()})


def shaken(name: str, share: float, size: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(values: np.ndarray) -> np.ndarray:
        log = {name: values.copy()}
        scattered(name, share, size)(log)
        return log[name]

    return change


def lost(share: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: np.where(np.random.default_rng(8).random(values.shape[1]) < share, np.nan, values)


@cache
def clean() -> Fit:
    """The fit of the good log."""
    return found(spoiled())


def deviation(fit: Fit) -> float:
    """By how many of its standard deviations a parameter is off that of the good log, at most."""
    return float((np.abs(fit.theta - clean().theta) / np.sqrt(np.diag(clean().covariance))).max())


def test_a_good_log_is_fitted_by_least_squares_as_it_is() -> None:
    windows = clean().problem.windows
    assert (windows.pressure_weights == 1).all()
    assert (windows.position_weights == windows.valid).all()
    assert np.abs(clean().theta - coordinates(TRUE, SOME)).max() < 0.02


def test_outliers_hardly_move_the_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    log = spoiled(pressures=shaken("pressures", 0.01, 2e4), positions=shaken("positions", 0.002, 4e-3))
    fit = found(log)
    assert deviation(fit) < 2.0
    assert 10 < (fit.problem.windows.pressure_weights < 0.9).sum() < 80
    monkeypatch.setattr(estimate, "MOST_WEIGHTS", 1)
    assert deviation(found(log)) > 3 * deviation(fit)


def test_what_was_not_measured_does_not_count() -> None:
    log = spoiled(pressures=lost(0.05), positions=lost(0.02))
    fit = found(log)
    assert deviation(fit) < 2.0
    residual = fit.problem.settled(fit.theta)[1]
    cells = residual[:, : fit.problem.windows.length * 4].reshape(fit.problem.windows.pressure_weights.shape)
    missing = np.isnan(np.stack([log.pressures[:, s : s + fit.problem.windows.length].T for s in fit.problem.windows.starts]))
    assert missing.any()
    assert (cells[missing] == 0).all()
    assert (cells[~missing] != 0).all()


def test_windows_without_openings_or_samples_are_not_cut() -> None:
    whole = part(trial(), 0, 2500)
    unknown = np.zeros(2500, dtype=np.bool_)
    unknown[1010:1030] = True
    starts = set(cut(whole, KNOWN, 0.1).starts)
    # 0.03 s after a gap the spools have forgotten it.
    assert starts - set(cut(dataclasses.replace(whole, unknown=unknown), KNOWN, 0.1).starts) == {1000}
    silent = dataclasses.replace(whole, positions=np.where(np.abs(np.arange(2500) - 1250) < 70, np.nan, whole.positions))
    assert starts - set(cut(silent, KNOWN, 0.1).starts) == {1200, 1300}
    with pytest.raises(ValueError, match=r"too many gaps.*allowed"):
        cut(dataclasses.replace(whole, unknown=~unknown), KNOWN, 0.1)


def test_a_search_without_end_names_where_the_log_does_not_fit() -> None:
    asked = problem(spoiled(), Budget(4.0))
    with pytest.raises(ValueError, match=r"the log and the model of the rig disagree.* s; allowed: columns"):
        search(asked, coordinates(KNOWN, SOME), 20)


def lost_in(monkeypatch: pytest.MonkeyPatch, *lost: int, spent: bool = False) -> None:
    """Searches of which those with the numbers ``lost`` find nothing, and have ``spent`` all of the budget."""
    numbers = itertools.count()

    def change(problem: Problem, theta: np.ndarray, most: int) -> Fit:
        if (number := next(numbers)) not in lost:
            return search(problem, theta, most)
        problem.windows.budget.left -= 1e9 if spent else 0.0
        raise ValueError(f"search {number} finds nothing")

    monkeypatch.setattr(estimate, "search", change)


def test_a_beginning_that_loses_its_way_leaves_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    lost_in(monkeypatch, 0)
    assert np.abs(estimate.fit(spoiled(), KNOWN, 0, SOME).theta - coordinates(TRUE, SOME)).max() < 0.02
    lost_in(monkeypatch, 0, 1)
    with pytest.raises(ValueError, match="search 0 finds nothing"):
        estimate.fit(spoiled(), KNOWN, 0, SOME)


def test_where_the_budget_ends_the_fit_before_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    lost_in(monkeypatch, 1, spent=True)
    kept = estimate.fit(spoiled(), KNOWN, 0, SOME)
    assert kept.problem.windows.budget.over
    assert np.abs(kept.theta - coordinates(TRUE, SOME)).max() < 0.02
    lost_in(monkeypatch, 1)
    with pytest.raises(ValueError, match="search 1 finds nothing"):
        estimate.fit(spoiled(), KNOWN, 0, SOME)


def test_a_part_of_a_budget_leaves_the_rest() -> None:
    budget = Budget(100.0)
    with budget.part(0.4):
        budget.spend(30.0)
    assert budget.left == 70.0
    with pytest.raises(UnsettledError), budget.part(0.5):
        budget.spend(36.0)
    assert 34.0 <= budget.left < 35.0
    budget.spend(34.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_predictions_that_are_no_numbers_are_no_word_of_a_library(bad: float, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = problem(spoiled())
    predict = starts.predict
    monkeypatch.setattr(starts, "predict", lambda *given: tuple(bad * values for values in predict(*given)))
    with pytest.raises(ValueError, match=r"the log and the model of the rig disagree.*; allowed: columns"):
        search(asked, coordinates(KNOWN, SOME), 20)


def test_a_force_that_the_log_lacks_is_named() -> None:
    """A sensor that shows 8 N too much along x: the log lacks -8 N."""
    assert not force_offset(clean()).is_there
    shown = force_offset(found(spoiled(forces=lambda forces: forces + np.array([[8.0], [0.0]]))))
    assert shown.is_there
    assert shown.force[0] == pytest.approx(-8.0, abs=3 * shown.deviation[0])
    assert "offset of the force sensor" in shown.words()
