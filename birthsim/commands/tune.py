"""birthsim tune: find the gains of a controller by simulation, the same way for every controller.

A controller says what may be tuned by a class attribute ``TUNABLE: dict[str, tuple[float, float]]``, gain -> (low, high), SI
units; each is a keyword of its constructor. Where low is positive the gain is searched on a logarithmic scale, else on a
linear one. That holds for names of the registry and for ``path/to/file.py:Class``.

A trial runs the gains through worlds that no evaluation uses (seeds from 3,000,000 on), every lane with a rig of its own from
the documented ranges. The worlds are those of ``Circle-v2``, of one cylinder ``Rail-v0``, rig and scenario drawn, and of the
stiffness test of ``baselines.bench.probes``, with each sensor model. With ``--friction drawn`` every rig has one of several
friction laws, which the controller does not know (``birthsim_env.parts.drawn.frictions``). That is an option and no default, so
that the commands that pages name still find the gains that are stored. The loss of a lane is in mm: in the scenario the settled
error, in the stiffness test the error of the displacement at full force plus the hunting. A lost lane costs ``WORST``, and no
lane more. The cost is the sum over scenarios and sensors of mean + 95 % quantile of the loss. Trial 0 has the middle of every
range, or the gains of a file. The next trials are drawn at random; Optuna's TPE sampler proposes the rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter
from tqdm import tqdm

from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import controller_settings, file_hash
from baselines.bench.probes import POSES, StiffnessTest, run_stiffness_test
from baselines.bench.statistics import penalize_lost
from baselines.controller import Controller
from baselines.named import make_controller, split_options
from baselines.tables import aligned
from baselines.work.tasks import Task, result_of
from birthsim.command_line.settings import CONTROLLER, SENSORS, Friction, Parts, RigFile, Seed, Set, named, whole
from birthsim.command_line.worlds import check_world, with_options
from birthsim_env.extras import installation
from birthsim_env.files import own_folder, whole_results, write_json
from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.parts.drawn.randomization import described, documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.topology import RAIL, TWO_CYLINDERS
from birthsim_env.physics.rig.values import is_within, shown
from birthsim_env.registry import entries

if TYPE_CHECKING:
    from optuna import Study

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

FOLLOWED = {TWO_CYLINDERS: "circle", RAIL: "rail"}
"""``linkage.kind`` -> the scenario whose target a controller follows."""

PLACES = (0.0, -0.6, 0.3, -0.3, 0.6)
"""Halves of the stroke from mid stroke at which a rail is pushed; assumed."""

Gains = dict[str, float]
Bounds = dict[str, tuple[float, float]]


def bounds_of(name: str, rig: Parameters) -> Bounds:
    """Lowest and highest value to try of a controller's gains; ``ValueError`` where it has no proper table of them."""
    kind = type(make_controller(name, rig))
    bounds = getattr(kind, "TUNABLE", None)
    if not bounds:
        known = ", ".join(one.name for one in entries("controller") if getattr(one.made, "TUNABLE", None))
        raise ValueError(f"controller = {name!r} has no gains to tune; allowed: {known}, or path/to/file.py:Class with TUNABLE")
    for gain, (low, high) in bounds.items():
        if not 0 <= low < high < math.inf:
            raise ValueError(f"{kind.__name__}.TUNABLE[{gain!r}] = {(low, high)!r}; allowed: 0 <= low < high, finite")
    return dict(bounds)


def start_of(path: Path | None, bounds: Bounds) -> Gains:
    """The gains of trial 0: those of a gains.json, or the middle of every range."""
    if path is None:
        return {name: math.sqrt(low * high) if low > 0 else high / 2 for name, (low, high) in bounds.items()}
    gains = read_json("--start", path, {"gains": dict})["gains"]
    for name, (low, high) in bounds.items():
        if name not in gains:
            raise ValueError(f"--start {str(path)!r} lacks {name!r}; allowed: JSON with gains: {', '.join(bounds)}")
        if not is_within(gains[name], least=low, most=high):
            raise ValueError(f"--start {str(path)!r} has {name} = {shown(gains[name])}; allowed: {low:g} to {high:g}")
    return {name: float(gains[name]) for name in bounds}


def probes(rig: Parameters, lanes: int, seed: int = WORLDS) -> StiffnessTest:
    """Stiffness tests on drawn rigs: the poses in turn, 1000-4000 N/m, 5-40 N either way along x or y, or along a rail."""
    rigs = [draw_parameters(rig, documented_ranges(rig), stream(seed + lane, 0, "parameters")) for lane in range(lanes)]
    rng, lane = np.random.default_rng(seed), np.arange(lanes)
    size, stiffness = rng.uniform(5, 40, lanes) * rng.choice([-1, 1], lanes), np.zeros((3, lanes))
    stiffness[:2] = rng.uniform(1000, 4000, lanes)
    if rig.linkage.is_rail:
        stiffness[1] = stiffness[0]
        direction = np.array(exact.direction(rig.linkage.inclination))[:, None]
        along = rig.geometry.k2 + 0.5 * rig.cylinder2.stroke * np.resize(PLACES, lanes)
        return StiffnessTest(direction * along, direction * size, stiffness, rigs)
    force = np.zeros((2, lanes))
    force[lane % 2, lane] = size
    return StiffnessTest(np.ascontiguousarray(np.resize(POSES, (lanes, 2)).T), force, stiffness, rigs)


def robust(losses: Array) -> float:
    """Mean + 95 % quantile of the losses (N,), mm, none of which counts more than ``WORST``."""
    capped = np.fmin(losses, WORST)
    return float(capped.mean() + np.quantile(capped, 0.95))


def costs(
    controller: Controller, rig: Parameters, sensors: tuple[str, ...], lanes: int, seconds: float = 8.0, **own: Any
) -> dict[str, float]:
    """What a controller costs, mm, part by part; ``seconds`` is that of the scenario of ``FOLLOWED``, which may have a
    reference and hand of its ``own``."""
    parts, followed = {}, FOLLOWED[rig.linkage.kind]
    periods = round(seconds / rig.electronics.control_period)
    setting: dict[str, Any] = {"randomize": True, "parameters": rig, "max_episode_steps": periods, "progress": False, **own}
    for kind in sensors:
        course = evaluate(environment_id(followed), controller, "", lanes, WORLDS, sensors=kind, **setting)
        if len(course.seeds) < lanes:
            raise KeyboardInterrupt  # which ``evaluate`` has caught, to keep what is complete
        parts[f"{followed}, {kind}"] = robust(penalize_lost(course.metrics["settled_rms"], course.lost, True))
        answers = run_stiffness_test(probes(rig, lanes), controller, kind, WORLDS)
        missed = np.hypot(*(answers.displacement - answers.expected)) + answers.hunting.max(axis=0)
        parts[f"stiffness test, {kind}"] = robust(penalize_lost(1e3 * missed, answers.lost, True))
    return parts


def costs_of(
    controller: str, rig: dict[str, Any], own: dict[str, Any], sensors: list[str], lanes: int, gains: Gains, **_: Any
) -> dict[str, float]:
    """``costs`` of a controller by name with ``gains``; what else is given only tells trials apart."""
    believed = Parameters.from_dict(rig)
    return costs(make_controller(controller, believed, **gains), believed, tuple(sensors), lanes, **own)


def begun(start: Gains) -> Study:
    """A search whose first trial is ``start``; ``ValueError`` where Optuna is missing."""
    try:
        import optuna
    except ImportError as error:
        raise ValueError(f"{error}; tuning needs the extra: {installation('tune')}") from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study()
    study.enqueue_trial(start)
    return study


def search(
    study: Study, folder: Path, setting: dict[str, Any], bounds: Bounds, seed: int, count: int
) -> Iterator[dict[str, Any]]:
    """``count`` trials, one by one, as gains, cost and its parts; those of this ``setting`` in ``folder`` are not run again."""
    from optuna.distributions import BaseDistribution, FloatDistribution
    from optuna.samplers import TPESampler

    ranges: dict[str, BaseDistribution] = {
        gain: FloatDistribution(low, high, log=low > 0) for gain, (low, high) in bounds.items()
    }
    for number in range(count):
        # A sampler of its own for each trial: what it proposes depends on the seed and the trials before alone, so that an
        # interrupted search goes on as if it had not been interrupted.
        own_seed = int(np.random.SeedSequence([seed, number]).generate_state(1)[0])
        study.sampler = TPESampler(seed=own_seed, n_startup_trials=RANDOM, constant_liar=False)
        trial = study.ask(ranges)
        parts = result_of(Task(f"trials/{number}", costs_of, {**setting, "gains": trial.params}), folder)
        cost = sum(parts.values())
        study.tell(trial, cost)
        yield {"gains": trial.params, "cost": cost, "parts": parts}


@dataclass(kw_only=True)
class Settings(Parts):
    """Tune a controller's gains on randomised rigs; after an interruption (Ctrl-C) the same command continues."""

    controller: Annotated[str, CONTROLLER]
    """A name, or path/to/file.py:Class whose TUNABLE has the range of each gain."""
    set: Set = field(default_factory=list)
    trials: Annotated[int, whole(1, TRIALS)] = 60
    """Sets of gains to try."""
    seed: Seed = 0
    """Seed of the search."""
    sensors: Annotated[str, SENSORS, Parameter(validator=named("sensors", "both"))] = "both"
    """Sensor model; both: ideal and lab."""
    start: Path | None = None
    """A gains.json with the gains of trial 0. [default: the middle of every range]"""
    lanes: Annotated[int, whole(1, LANES)] = 32
    """Number of rigs of each scenario."""
    friction: Friction | None = None
    parameters: RigFile = None
    out: Path
    """Folder for trials, trials.json and gains.json."""


def main(settings: Settings) -> None:
    """Run the trials that the folder lacks, and print the best."""
    rig = with_friction(load_parameters(settings.parameters), settings.friction or "")
    sensors = TUNED_FOR if settings.sensors == "both" else (settings.sensors,)
    controller, own = with_options([settings.controller], settings.set)[0], settings.parts()
    bounds = {name: pair for name, pair in bounds_of(controller, rig).items() if name not in split_options(controller)[1]}
    start = start_of(settings.start, bounds)
    setting = {
        **controller_settings(controller, rig), "own": own, "files": [*map(file_hash, own.values())],
        "sensors": list(sensors), "lanes": settings.lanes,
    }  # fmt: skip
    study = begun(start)
    followed = environment_id(FOLLOWED[rig.linkage.kind])
    check_world(followed, parameters=rig, randomize=True, **own)  # which compiles: Optuna is looked for before
    trials: list[dict[str, Any]] = []
    interrupt: KeyboardInterrupt | None = None
    print(described(rig, True))
    with own_folder(settings.out) as folder:
        try:
            with tqdm(total=settings.trials, desc=f"tuning {controller}", unit=" trials", leave=False) as bar:
                for trial in search(study, folder, setting, bounds, settings.seed, settings.trials):
                    trials.append(trial)
                    bar.set_postfix_str(f"best {min(one['cost'] for one in trials):.3g} mm", refresh=False)
                    bar.update()
        except KeyboardInterrupt as error:
            if not trials:
                raise
            interrupt = error
            print(f"interrupted: {len(trials)} of {settings.trials} trials are kept; the same command carries on")
        first, best = trials[0], min(trials, key=lambda trial: trial["cost"])
        place = {"trial": trials.index(best), "trials": len(trials)}
        asked = {
            **setting, "seed": settings.seed, "bounds": {name: list(pair) for name, pair in bounds.items()}, "start": start,
        }  # fmt: skip
        with whole_results(folder) as results:
            write_json(results / "trials.json", {**asked, "trials": trials})
            write_json(results / "gains.json", {**asked, **best, **place})
    print(f"{controller}, {', '.join(sensors)} sensors, best of {len(trials)} trials: number {place['trial']}\n")
    spent = [{**one["parts"], "sum": one["cost"]} for one in (first, best)]
    print(aligned(("cost, mm", "start", "best"), [(part, *(f"{one[part]:.3f}" for one in spent)) for part in spent[0]]))
    gains = [(gain, *(f"{each:.4g}" for each in (start[gain], value, *bounds[gain]))) for gain, value in best["gains"].items()]
    print(f"\n{aligned(('gain', 'start', 'best', 'lowest', 'highest'), gains)}")
    print(f"\nwritten to {settings.out}/: gains.json, trials.json")
    if interrupt is not None:
        raise interrupt
