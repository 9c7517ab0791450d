"""Optuna's search in batches: the same proposals whatever the number of processes and kills."""

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from baselines.bench.statistics import penalize_lost, summarize
from baselines.work.tasks import Result, Task
from birthsim_env.extras import installation
from lab.studies.sweeps.plan import Point, Search, Sweep
from lab.studies.sweeps.work import Piece, complete, pieces_of

WORST = 1000.0
"""What a search counts where the figure is infinite or no number, in the metric's unit; assumed."""


def next_trials(sweep: Sweep, found: Mapping[Piece, Result]) -> dict[Piece, Task]:
    """The pieces of the next batch of trials, each at every point of the sweep's grid and draws; none after the last.

    What is proposed depends on the search's seed and the batches before it, which ``found`` has.
    """
    optuna, search, known = _optuna(), _search(sweep), _trials(sweep, found)
    first = len(known)
    seed = int(np.random.SeedSequence([search.seed, first // search.batch]).generate_state(1)[0])
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, constant_liar=True))
    study.add_trials(known)
    asked = [study.ask(_ranges(search)) for _ in range(min(search.batch, search.trials - first))]
    points = [{**point, **trial.params, "trial": trial.number} for trial in asked for point in sweep.points]
    return pieces_of(points, sweep, first * len(sweep.points))


def best_trial(sweep: Sweep, found: Mapping[Piece, Result]) -> dict[str, Any] | None:
    """Number, cost and ranges' values of the trial with the least cost; None where none is complete."""
    trials, search = _trials(sweep, found), _search(sweep)
    if not trials:
        return None
    best = min(trials, key=lambda trial: trial.value)
    return {"trial": trials.index(best), f"{search.metric} {search.statistic}": best.value, **best.params}


def write_journal(sweep: Sweep, found: Mapping[Piece, Result], path: Path) -> None:
    """The trials, for Optuna's own tools."""
    optuna = _optuna()
    storage = optuna.storages.JournalStorage(optuna.storages.journal.JournalFileBackend(str(path)))
    optuna.create_study(storage=storage, study_name="birthsim-sweep").add_trials(_trials(sweep, found))


def _optuna() -> ModuleType:
    try:
        import optuna
    except ImportError as error:
        raise ValueError(f"{error}; a search needs the extra: {installation('tune')}") from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


def _ranges(search: Search) -> dict[str, Any]:
    make = _optuna().distributions.FloatDistribution
    return {name: make(axis.low, axis.high, log=axis.log) for name, axis in search.ranges.items()}


def _search(sweep: Sweep) -> Search:
    assert sweep.search is not None
    return sweep.search


def _trials(sweep: Sweep, found: Mapping[Piece, Result]) -> list[Any]:
    """Complete trials, in order, as Optuna has them."""
    search, own = _search(sweep), dict[int, list[tuple[Point, list[Result]]]]()
    for point, results in zip(*complete(found), strict=True):
        own.setdefault(point["trial"], []).append((point, results))
    make, ranges = _optuna().trial.create_trial, _ranges(search)
    trials = []
    for points in (points for points in own.values() if len(points) == len(sweep.points)):
        params = {name: points[0][0][name] for name in search.ranges}
        cost = _cost([piece for _, results in points for piece in results], search)
        trials.append(make(params=params, distributions=ranges, value=cost))
    return trials


def _cost(pieces: list[Result], search: Search) -> float:
    values = [np.nan if v is None else v for piece in pieces for v in piece["metrics"][search.metric]]
    lost = [one for piece in pieces for one in piece["lost"]]
    figure = summarize(np.fmin(penalize_lost(values, lost, applies=True), WORST))[search.statistic]
    return float(figure) if np.isfinite(figure) else WORST
