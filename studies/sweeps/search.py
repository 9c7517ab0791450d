"""Optuna's search in batches: the same proposals whatever the number of processes and kills."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.statistics import penalize_lost, summarize
from baselines.work.journal import open_journal
from baselines.work.tasks import Result
from studies.sweeps.plan import Point, Search, Sweep

WORST = 1000.0
"""What a search counts where the figure is infinite or no number, in the metric's unit; assumed."""

Evaluated = Callable[[Sequence[Point], str], tuple[list[list[Result] | None], dict[str, str]]]


def search_points(sweep: Sweep, evaluated: Evaluated, folder: Path) -> tuple[list[Point], list[list[Result] | None]]:
    """Points and results of all trials, each trial at every point of the sweep's grid and draws.

    The journal ``trials.journal`` in ``folder`` holds the trials, for Optuna's own tools. A trial's proposal depends on the
    search's seed and the batches before it; a batch that a kill has left is evaluated from its pieces and told again.
    """
    search = sweep.search
    assert search is not None
    try:
        import optuna
        from optuna.distributions import BaseDistribution, FloatDistribution
        from optuna.trial import TrialState
    except ImportError as error:
        raise ValueError(f"{error}; a search needs the extra: pip install 'birthsim[tune]'") from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    ranges: dict[str, BaseDistribution] = {
        name: FloatDistribution(axis.low, axis.high, log=axis.log) for name, axis in search.ranges.items()
    }
    # Proposals come from a study in memory that is told everything in order; the journal is written beside it.
    study = optuna.create_study()
    with warnings.catch_warnings(action="ignore"):
        journal = optuna.create_study(
            storage=open_journal(folder / "trials.journal"), study_name="birthsim-sweep", load_if_exists=True
        )  # fmt: skip
    known = sum(trial.state is TrialState.COMPLETE for trial in journal.get_trials(deepcopy=False))
    points: list[Point] = []
    results: list[list[Result] | None] = []
    for batch, first in enumerate(range(0, search.trials, search.batch)):
        seed = int(np.random.SeedSequence([search.seed, batch]).generate_state(1)[0])
        study.sampler = optuna.samplers.TPESampler(seed=seed, constant_liar=True)
        trials = [study.ask(ranges) for _ in range(min(search.batch, search.trials - first))]
        proposed = [{**point, **trial.params, "trial": trial.number} for trial in trials for point in sweep.points]
        found, failures = evaluated(proposed, f"trials {first} to {first + len(trials) - 1}")
        if failures:
            raise ValueError(f"a trial failed, {next(iter(failures.items()))}; allowed: ranges in which every rig can be")
        each = len(sweep.points)
        for k, trial in enumerate(trials):
            cost = _cost(found[k * each : (k + 1) * each], search)
            study.tell(trial, cost)
            if trial.number >= known:
                journal.add_trial(optuna.trial.create_trial(params=trial.params, distributions=ranges, value=cost))
        points += proposed
        results += found
    best = study.best_trial
    gains = ", ".join(f"{name} = {value:.5g}" for name, value in best.params.items())
    print(f"best of {search.trials} trials: number {best.number}, {search.metric} {search.statistic} {best.value:.4g}: {gains}")
    return points, results


def _cost(pieces_of: Sequence[list[Result] | None], search: Search) -> float:
    pieces: list[Any] = [piece for pieces in pieces_of for piece in pieces or ()]
    values = [np.nan if v is None else v for piece in pieces for v in piece["metrics"][search.metric]]
    lost = [one for piece in pieces for one in piece["lost"]]
    figure = summarize(np.fmin(penalize_lost(values, lost, applies=True), WORST))[search.statistic]
    return float(figure) if np.isfinite(figure) else WORST
