"""birthsim tune: find the gains of a controller by simulation, the same way for every controller.

A controller says what may be tuned by a class attribute ``TUNABLE: dict[str, tuple[float, float]]``, gain -> (low, high), SI
units; each is a keyword of its constructor. Where low is positive the gain is searched on a logarithmic scale, else on a
linear one. That holds for names of the registry and for ``path/to/file.py:Class``.

A trial runs the gains through worlds that no evaluation uses (seeds from 3,000,000 on), every lane with a rig of its own from
the documented ranges. The worlds are those of ``Circle-v1``, rig and scenario drawn, and of the stiffness test of
``baselines.bench.probes``, with each sensor model. The loss of a lane is in mm: on the circle the settled error, in the
stiffness test the error of the displacement at full force plus the hunting. A lost lane costs ``WORST``, and no lane more. The
cost is the sum over scenarios and sensors of mean + 95 % quantile of the loss. Trial 0 has the middle of every range, or the
gains of a file. The next trials are drawn at random; Optuna's TPE sampler proposes the rest.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

import numpy as np
from cyclopts import Parameter
from tqdm import tqdm

from baselines.bench.evaluation import evaluate
from baselines.bench.probes import POSES, StiffnessTest, run_stiffness_test
from baselines.bench.statistics import penalize_lost
from baselines.commands.settings import CONTROLLER, WORLD, Kind, Parts, RigFile, Seed, Set, whole
from baselines.commands.tables import aligned
from baselines.commands.worlds import check_world, with_options
from baselines.controller import Controller
from baselines.registry import CONTROLLERS, make_controller, split_options
from birthsim_env.files import own_folder, whole_results, write_json
from birthsim_env.parts.drawn.randomization import described, documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.reading import read_json
from birthsim_env.physics.rig.values import is_finite, is_within, problem, shown

if TYPE_CHECKING:
    from optuna import Study
    from optuna.storages import JournalStorage
    from optuna.trial import FrozenTrial

TUNED_FOR = ("ideal", "lab")
"""Sensors that the laws' published gains were tuned for."""

WORLDS = 3_000_000
"""Seed of the first lane; those of evaluations, trainings and validations are lower."""

WORST = 20.0
"""mm, assumed: the most that a lane costs, be it lost or not. It is less than ``LOST_ERROR``, so that one bad lane does not
outweigh all others."""

LANES, TRIALS = 4096, 100_000
"""Most rigs and most trials: so many rigs take minutes and a GB a trial, and the sampler reads all trials each time."""

RANDOM = 20
"""Trials before the sampler models their costs: the start and those drawn at random."""

Gains = dict[str, float]
Bounds = dict[str, tuple[float, float]]


def bounds_of(name: str, rig: Parameters) -> Bounds:
    """Lowest and highest value to try of a controller's gains; ``ValueError`` where it has no proper table of them."""
    kind = type(make_controller(name, rig))
    bounds = getattr(kind, "TUNABLE", None)
    if not bounds:
        makers = {other: getattr(factory, "func", factory) for other, factory in CONTROLLERS.items()}
        known = ", ".join(other for other, maker in makers.items() if getattr(maker, "TUNABLE", None))
        raise ValueError(f"controller = {name!r} has no gains to tune; allowed: {known}, or path/to/file.py:Class with TUNABLE")
    for gain, (low, high) in bounds.items():
        if not 0 <= low < high < math.inf:
            raise ValueError(f"{kind.__name__}.TUNABLE[{gain!r}] = {(low, high)!r}; allowed: 0 <= low < high, finite")
    return dict(bounds)


def start_of(path: Path | None, bounds: Bounds) -> Gains:
    """The gains of trial 0: those of a gains.json, or the middle of every range."""
    if path is None:
        return {name: math.sqrt(low * high) if low > 0 else high / 2 for name, (low, high) in bounds.items()}
    content = read_json("--start", path)
    gains: Any = content.get("gains") if isinstance(content, dict) else None
    for name, (low, high) in bounds.items():
        if not isinstance(gains, dict) or name not in gains:
            raise ValueError(f"--start {str(path)!r} lacks {name!r}; allowed: JSON with gains: {', '.join(bounds)}")
        if not is_within(gains[name], least=low, most=high):
            raise ValueError(f"--start {str(path)!r} has {name} = {shown(gains[name])}; allowed: {low:g} to {high:g}")
    return {name: float(gains[name]) for name in bounds}


def probes(rig: Parameters, lanes: int) -> StiffnessTest:
    """Stiffness tests on drawn rigs: the poses in turn, 1000-4000 N/m, 5-40 N either way along x or y."""
    rigs = [draw_parameters(rig, documented_ranges(rig), stream(WORLDS + lane, 0, "parameters")) for lane in range(lanes)]
    rng, lane = np.random.default_rng(WORLDS), np.arange(lanes)
    force, stiffness = np.zeros((2, lanes)), np.zeros((3, lanes))
    force[lane % 2, lane] = rng.uniform(5, 40, lanes) * rng.choice([-1, 1], lanes)
    stiffness[:2] = rng.uniform(1000, 4000, lanes)
    return StiffnessTest(np.ascontiguousarray(np.resize(POSES, (lanes, 2)).T), force, stiffness, rigs)


def robust(losses: Array) -> float:
    """Mean + 95 % quantile of the losses (N,), mm, none of which counts more than ``WORST``."""
    capped = np.fmin(losses, WORST)
    return float(capped.mean() + np.quantile(capped, 0.95))


def costs(
    controller: Controller, rig: Parameters, sensors: tuple[str, ...], lanes: int, seconds: float = 8.0, **own: Any
) -> dict[str, float]:
    """What a controller costs, mm, part by part; ``seconds`` is that of the circle, which may have a reference and hand of its
    ``own``."""
    parts = {}
    periods = round(seconds / rig.electronics.control_period)
    setting: dict[str, Any] = {"randomize": True, "parameters": rig, "max_episode_steps": periods, "progress": False, **own}
    for kind in sensors:
        circle = evaluate("BirthSIM/Circle-v1", controller, "", lanes, WORLDS, sensors=kind, **setting)
        if len(circle.seeds) < lanes:
            raise KeyboardInterrupt  # which ``evaluate`` has caught, to keep what is complete
        parts[f"circle, {kind}"] = robust(penalize_lost(circle.metrics["settled_rms"], circle.lost, True))
        answers = run_stiffness_test(probes(rig, lanes), controller, kind, WORLDS)
        missed = np.hypot(*(answers.displacement - answers.expected)) + answers.hunting.max(axis=0)
        parts[f"stiffness test, {kind}"] = robust(penalize_lost(1e3 * missed, answers.lost, True))
    return parts


def check_optuna() -> None:
    """Raises ``ValueError`` where Optuna is missing, before anything is made."""
    try:
        import optuna  # noqa: F401
    except ImportError as error:
        raise ValueError(f"{error}; tuning needs the extra: pip install 'birthsim[tune]'") from error


def open_journal(path: Path) -> JournalStorage:
    """Optuna's journal at ``path``, without a last line that has no end, as a killed process may have left it."""
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    if path.exists():
        os.truncate(path, path.read_bytes().rfind(b"\n") + 1)
    # Optuna's own lock file outlives a process that is killed: the folder has one owner already.
    return JournalStorage(JournalFileBackend(str(path), cast(Any, threading.Lock())))


def open_study(folder: Path, setting: dict[str, Any]) -> Study:
    """The search that a folder holds, or a new one there; ``ValueError`` where it holds another one or something else."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    path = folder / "trials.journal"
    try:
        study = optuna.create_study(storage=open_journal(path), study_name="birthsim-tune", load_if_exists=True)
        # The first run may have been killed before it came to all of them.
        known = {**({} if complete(study) else setting), **study.user_attrs}
        if all(known.get(key) == value for key, value in setting.items()):
            for key, value in setting.items():
                study.set_user_attr(key, value)
            listed(study)
            return study
    except (MemoryError, OSError):
        raise
    except Exception as error:
        # Damage trips Optuna in a dozen ways.
        raise ValueError(
            f"{path} is no list of trials ({problem(error)}); allowed: what birthsim tune wrote, or another --out"
        ) from error
    key = next(key for key, value in setting.items() if known.get(key) != value)
    raise ValueError(f"{path} has {key} = {shown(known.get(key))}; allowed: {shown(setting[key])}, or another --out")


def complete(study: Study) -> list[FrozenTrial]:
    """The trials that have a cost; an interrupted one has none and says nothing."""
    from optuna.trial import TrialState

    return study.get_trials(states=(TrialState.COMPLETE,))


def listed(study: Study) -> list[dict[str, Any]]:
    """The complete trials as JSON: gains, cost and its parts; ``ValueError`` for one that birthsim tune did not write."""
    trials = []
    for trial in complete(study):
        parts = trial.user_attrs.get("parts")
        if not (isinstance(parts, dict) and all(map(is_finite, parts.values())) and is_finite(trial.value)):
            raise ValueError(f"trial {trial.number} has no cost in parts")
        trials.append({"gains": trial.params, "cost": trial.value, "parts": parts})
    return trials


def search(
    study: Study, name: str, rig: Parameters, start: Gains, bounds: Bounds, sensors: tuple[str, ...], lanes: int, seed: int,
    count: int, own: dict[str, Any],
) -> Iterator[None]:  # fmt: skip
    """Run the trials that the study lacks of ``count``, one by one."""
    from optuna.distributions import BaseDistribution, FloatDistribution
    from optuna.samplers import TPESampler
    from optuna.trial import TrialState

    ranges: dict[str, BaseDistribution] = {
        gain: FloatDistribution(low, high, log=low > 0) for gain, (low, high) in bounds.items()
    }
    while (done := len(complete(study))) < count:
        if done == 0 and not study.get_trials(deepcopy=False, states=(TrialState.WAITING,)):
            study.enqueue_trial(start)
        # A sampler of its own for each trial: what it proposes depends on the seed and the complete trials alone, so that an
        # interrupted search goes on as if it had not been interrupted.
        own_seed = int(np.random.SeedSequence([seed, done]).generate_state(1)[0])
        study.sampler = TPESampler(seed=own_seed, n_startup_trials=RANDOM, constant_liar=False)
        trial = study.ask(ranges)
        parts = costs(make_controller(name, rig, **trial.params), rig, sensors, lanes, **own)
        trial.set_user_attr("parts", parts)
        study.tell(trial, sum(parts.values()))
        yield


@dataclass(kw_only=True)
class Settings(Parts):
    """Tune a controller's gains on rigs drawn at random; interrupted (Ctrl-C), the same command carries on."""

    controller: Annotated[str, CONTROLLER]
    """A name, or path/to/file.py:Class, with TUNABLE."""
    set: Set = field(default_factory=list)
    trials: Annotated[int, whole(1, TRIALS)] = 60
    """Sets of gains to try."""
    seed: Seed = 0
    """Of the search."""
    sensors: Annotated[Kind | Literal["both"], Parameter(group=WORLD, metavar="CHOICE")] = "both"
    """Sensor model; both: ideal and lab."""
    start: Path | None = None
    """A gains.json, for trial 0, else the middle of every range."""
    lanes: Annotated[int, whole(1, LANES)] = 32
    """Rigs of each scenario."""
    parameters: RigFile = None
    out: Path
    """Folder for trials.journal, trials.json and gains.json."""


def main(settings: Settings) -> None:
    """Run the trials that the folder lacks, and print the best."""
    rig = load_parameters(settings.parameters)
    sensors = TUNED_FOR if settings.sensors == "both" else (settings.sensors,)
    controller, own = with_options([settings.controller], settings.set)[0], settings.parts()
    bounds = {name: pair for name, pair in bounds_of(controller, rig).items() if name not in split_options(controller)[1]}
    start = start_of(settings.start, bounds)
    setting = {
        "controller": controller, **own, "seed": settings.seed, "sensors": list(sensors), "lanes": settings.lanes,
        "bounds": {name: list(pair) for name, pair in bounds.items()}, "start": start, "rig": rig.to_dict(),
    }  # fmt: skip
    check_world("BirthSIM/Circle-v1", parameters=rig, randomize=True, **own)
    print(described(rig, True))
    check_optuna()
    with own_folder(settings.out) as folder:
        study = open_study(folder, setting)
        kept = len(complete(study)[: settings.trials])
        bar = tqdm(total=settings.trials, initial=kept, desc=f"tuning {controller}", unit=" trials", leave=False)
        interrupt: KeyboardInterrupt | None = None
        try:
            numbers = (settings.lanes, settings.seed, settings.trials)
            for _ in search(study, controller, rig, start, bounds, sensors, *numbers, own):
                bar.set_postfix_str(f"best {study.best_value:.3g} mm", refresh=False)
                bar.update()
        except KeyboardInterrupt as error:
            if not (kept := len(complete(study))):
                raise
            interrupt = error
            print(f"interrupted: {kept} of {settings.trials} trials are kept; the same command carries on")
        finally:
            bar.close()
        trials = listed(study)[: settings.trials]
        first, best = trials[0], min(trials, key=lambda trial: trial["cost"])
        place = {"trial": trials.index(best), "trials": len(trials)}
        with whole_results(folder) as results:
            write_json(results / "trials.json", {**setting, "trials": trials})
            write_json(results / "gains.json", {**setting, **best, **place})
    print(f"{controller}, {', '.join(sensors)} sensors, best of {len(trials)} trials: number {place['trial']}\n")
    spent = [{**one["parts"], "sum": one["cost"]} for one in (first, best)]
    print(aligned(("cost, mm", "start", "best"), [(part, *(f"{one[part]:.3f}" for one in spent)) for part in spent[0]]))
    gains = [(gain, *(f"{each:.4g}" for each in (start[gain], value, *bounds[gain]))) for gain, value in best["gains"].items()]
    print(f"\n{aligned(('gain', 'start', 'best', 'lowest', 'highest'), gains)}")
    print(f"\nwritten to {settings.out}/: gains.json, trials.json")
    if interrupt is not None:
        raise interrupt
