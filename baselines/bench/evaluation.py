"""Runs a controller over seeded episodes of an environment and measures it."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from operator import itemgetter
from typing import Any, Unpack

import gymnasium
import numpy as np
from tqdm import tqdm

from baselines.bench.feasibility import required_strength_ratio
from baselines.bench.measures import DISCOUNTS, Measures
from baselines.bench.metrics import UNITS, metrics_of
from baselines.bench.statistics import jsonable, number, penalize_lost, summarize
from baselines.controller import CommandFunction, Controller, Remarking, controller_of
from baselines.driving import Driving, driving
from baselines.named import make_controller
from baselines.tables import aligned, markdown
from birthsim_env.assembly import Arguments, refuse_unknown, spelled_out
from birthsim_env.ids import rig_for
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import checked_count, shown
from birthsim_env.simulation import Simulation

GIVEN = ("policy_period", "actuation")
"""Arguments of an environment that an evaluation sets itself."""

LANES = 256
"""Episodes that run side by side."""

MOST_EPISODES, MOST_SEED = 10**9, 2**63 - 1
"""Of an evaluation."""

AT_ONCE = 250
"""Control periods between two looks at what is lost, where nothing stops the loop."""

TIMED = 10
"""Calls of a controller, at least, over which its time is taken."""


@dataclass
class Evaluation:
    """What a controller reached over E episodes.

    Parameters
    ----------
    controller : str
        Its name.
    seeds : list of int
        Of the episodes, (E,).
    metrics : dict of str to list of float
        Metric -> its value in every episode, (E,); docs/reference/metrics.md has their units. Of a lost episode it is that
        of the time before.
    lost : list of bool
        Which episodes terminated, (E,).
    required_strength_ratio : list of float
        Fraction of the rig's strength that each episode asks for, (E,).
    returns : dict of float to list of float
        Discount -> sum of the rewards of each episode, (E,).
    success : list of bool
        ``info["is_success"]`` at the end of each episode, (E,).
    cost : float
        The controller's time per lane and call, us, which differs from run to run.
    traces : list of array
        Tracking errors over time, m, (T, lanes, 2) for each batch of episodes that ran side by side.
    remarks : list of str
        What the controller's ``remarks()``, if it has them, said at the ends of its batches, each sentence once.

    Examples
    --------
    ``evaluate`` returns one.

    >>> import birthsim
    >>> found = birthsim.evaluate("BirthSIM/Probe-v3", "admittance", episodes=2, progress=False)
    >>> sorted(found.summary()["settled_rms"])
    ['max', 'mean', 'median', 'q95']
    """

    controller: str
    seeds: list[int] = field(default_factory=list)
    metrics: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in UNITS})
    lost: list[bool] = field(default_factory=list)
    required_strength_ratio: list[float] = field(default_factory=list)
    returns: dict[float, list[float]] = field(default_factory=lambda: {discount: [] for discount in DISCOUNTS})
    success: list[bool] = field(default_factory=list)
    cost: float = float("nan")
    traces: list[Array] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def settled_error(self) -> dict[str, float]:
        """What screen and figure say of it: settled error, mm, as of ``summarize``, where a lost episode is infinitely bad."""
        return summarize(penalize_lost(self.metrics["settled_rms"], self.lost, applies=True))

    def summary(self) -> dict[str, dict[str, float]]:
        """Metric -> median, mean, 95 % and maximum over the episodes, of which a lost one is infinitely bad."""
        return {name: summarize(penalize_lost(values, self.lost)) for name, values in self.metrics.items()}

    def to_dict(self) -> dict[str, Any]:
        """What goes into the JSON file; ``summary`` says "lost" where a metric is infinite."""
        return {
            "controller": self.controller,
            "seeds": self.seeds,
            "units": UNITS,
            "summary": jsonable(self.summary()),
            "lost_episodes": int(sum(self.lost)),
            "episodes": self.metrics,
            "lost": self.lost,
            "required_strength_ratio": self.required_strength_ratio,
            "returns": self.returns,
            "success": self.success,
            # Without remarks the file is that of a controller that makes none, as entries of the leaderboard have it.
            **({"remarks": self.remarks} if self.remarks else {}),
        }


@spelled_out(*GIVEN)
def evaluate(
    environment: str,
    controller: str | Controller | CommandFunction,
    name: str | None = None,
    episodes: int = 32,
    seed: int = 0,
    progress: bool = True,
    **arguments: Unpack[Arguments],
) -> Evaluation:
    """Run a controller through seeded episodes of an environment and measure it.

    Parameters
    ----------
    environment : str
        An id, such as ``"BirthSIM/Circle-v2"``.
    controller : str, Controller or callable
        Its name, as ``make_controller`` takes it, which then assumes the rig that ``parameters`` describes; an object; or a
        function of measurement and reference. It commands at every control period.
    name : str, optional
        What tables call it; else its name, or that of its class.
    episodes : int
        Number of episodes E.
    seed : int
        Of the first episode; the others have seed + 1, seed + 2 and so on.
    progress : bool
        Whether bars are shown.
    action_mode, valves, sensors, force_sensor, randomize, parameters, reference, user_force, stiffness, duration
        Arguments of the environment, see ``birthsim_env.env.BirthSIMEnv``.
    picture_size, num_threads, clip_actions
        The same.

    Returns
    -------
    Evaluation
        Metrics of every episode. One that terminates is lost: ``metrics`` holds its values up to that moment, ``summary``
        counts them as infinite. After an interrupt (Ctrl-C) the episodes that are complete are returned.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.

    Examples
    --------
    >>> import birthsim
    >>> found = birthsim.evaluate("BirthSIM/Probe-v3", "admittance", episodes=2, randomize=True, progress=False)
    >>> found.controller, found.lost
    ('admittance', [False, False])
    >>> found.settled_error()["median"] < 1.0
    True
    """
    episodes, seed = checked_count("episodes", episodes, 1, MOST_EPISODES), checked_count("seed", seed, 0, MOST_SEED)
    if name is None:
        name = controller if isinstance(controller, str) else getattr(controller, "__name__", type(controller).__name__)
    if isinstance(controller, str):
        controller = make_controller(controller, rig_for(environment, arguments.get("parameters")))
    return evaluate_worlds(environment, controller, name, range(seed, seed + episodes), None, progress, **arguments)


def evaluate_worlds(
    environment: str,
    controller: Controller | CommandFunction,
    name: str,
    seeds: Sequence[int],
    rigs: Array | None,
    progress: bool = True,
    **arguments: Unpack[Arguments],
) -> Evaluation:
    """``evaluate`` in the worlds of ``seeds``; ``rigs`` (PARAMETERS, len(seeds)) are theirs where ``randomize`` draws none."""
    refuse_unknown(arguments, ("device", "max_episode_steps"), GIVEN)
    if arguments.get("device", "cpu") != "cpu":
        said = "birthsim_build.device.evaluation.evaluate_on evaluates on a device"
        raise ValueError(f"device = {shown(arguments['device'])}; allowed: 'cpu'; {said}")  # type: ignore[typeddict-item]
    result, law = Evaluation(name), controller_of(controller)
    spent: list[float] = []
    try:
        for own in batches(len(seeds)):
            lanes = None if rigs is None else rigs[:, own]
            _run_batch(environment, law, list(seeds[own]), lanes, arguments, result, spent, progress)
    except KeyboardInterrupt:
        if not result.seeds:
            raise
        print(f"interrupted: {len(result.seeds)} of {len(seeds)} episodes are complete and kept")
    result.cost = float(np.median(spent))
    return result


def batches(count: int) -> Iterator[slice]:
    """Which of ``count`` episodes run side by side."""
    first = 0
    while first < count:
        # Of four lanes (4, N) openings could be (N, 4) ones, and nobody would see it.
        lanes = 3 if min(LANES, count - first) == 4 else min(LANES, count - first)
        yield slice(first, first + lanes)
        first += lanes


def merged(evaluations: Sequence[Evaluation], name: str) -> Evaluation:
    """All episodes of several evaluations as one."""
    whole = Evaluation(name)
    for one in evaluations:
        for name in ("seeds", "lost", "required_strength_ratio", "success", "traces"):
            getattr(whole, name).extend(getattr(one, name))
        _remark(whole, one.remarks)
        for name in ("returns", "metrics"):
            for key, values in getattr(one, name).items():
                getattr(whole, name)[key].extend(values)
    whole.cost = float(np.median([one.cost for one in evaluations]))
    return whole


def _remark(whole: Evaluation, remarks: Sequence[str]) -> None:
    """Adds what was not said yet."""
    whole.remarks += [said for said in dict.fromkeys(remarks) if said not in whole.remarks]


def _run_batch(
    environment: str,
    controller: Controller,
    seeds: list[int],
    rigs: Array | None,
    arguments: Arguments,
    result: Evaluation,
    spent: list[float],
    progress: bool,
) -> None:
    period = rig_for(environment, arguments.get("parameters")).electronics.control_period
    driver = driving(controller, result.controller, asks=True)
    env: Any = gymnasium.make_vec(environment, num_envs=len(seeds), policy_period=period, actuation=driver, **arguments)
    if rigs is not None:
        env.simulation.plant.lane_parameters[:] = rigs
    env.reset(seed=list(seeds))
    asked, simulation = required_strength_ratio(env), env.simulation
    measures = Measures(simulation, env.steps)
    own = measures.own
    at_once = driver.held_periods or (1 if measures.stops else AT_ONCE)
    title = f"{result.controller}, episodes {seeds[0]}-{seeds[-1]}"
    bar = tqdm(total=env.steps, desc=title, unit=" steps", disable=not progress, leave=False)
    for step in range(0, env.steps, at_once):
        steps = min(at_once, env.steps - step)
        driver.ask(simulation.measurement, simulation.reference)
        simulation.run(steps)
        terminated = measures.terminated()
        if terminated.any():
            controller.reset(terminated)
        if not own.alive.any():
            break
        bar.update(steps)
    bar.close()
    spent += times_of(driver, simulation)
    env.close()
    for name, values in metrics_of(own, period, simulation.parameters.linkage.topology).items():
        result.metrics[name] += values.tolist()
    result.seeds += seeds
    result.required_strength_ratio += asked.tolist()
    result.lost += (own.alive == 0.0).tolist()
    result.success += (own.success > 0.0).tolist()
    for discount, sums in zip(DISCOUNTS, own.returns, strict=True):
        result.returns[discount] += sums.tolist()
    _remark(result, controller.remarks() if isinstance(controller, Remarking) else [])
    result.traces.append(measures.error.transpose(0, 2, 1))


def times_of(driver: Driving, simulation: Simulation) -> list[float]:
    """What calls of a controller took, us per lane, ``TIMED`` at least: one that was compiled into a loop is called now."""
    while len(driver.spent) < TIMED:
        driver.openings(simulation.plant, simulation.measurement, simulation.reference)
    return driver.spent


def overview(evaluations: list[Evaluation]) -> str:
    """A short table for the screen: settled error over the episodes, mm, and how many were lost."""
    rows, unsaid = [], []
    for one in evaluations:
        summary = one.settled_error()
        metrics = [number(summary[key]) for key in ("median", "q95", "max")]
        rows.append([one.controller, *metrics, f"{sum(one.lost)} of {len(one.lost)}"])
        # A hand that jumps all the time leaves nothing settled.
        never = int(np.isnan(np.asarray(one.metrics["settled_rms"])[~np.asarray(one.lost)]).sum())
        if never:
            unsaid.append(f"{one.controller}: {never} of {len(one.lost)} episodes were never settled and are left out above")
        unsaid += [f"{one.controller}: {said}" for said in one.remarks]
    return "\n".join([aligned(("settled error, mm", "median", "95 %", "largest", "lost episodes"), rows), *unsaid])


DATA = ("metric", "unit", "controller", "value", "q95", "max")
"""Columns: the median over the episodes, their 95th percentile and the largest; of lost and successful episodes the number."""


def _metrics(evaluations: Sequence[Evaluation]) -> Iterator[tuple[str, ...]]:
    """Rows of ``DATA``, metric by metric; those of which the environment says nothing are left out, "lost" is infinite."""
    summaries = [one.summary() for one in evaluations]
    for name, unit in UNITS.items():
        if not all(np.isnan(summary[name]["max"]) for summary in summaries):
            for one, summary in zip(evaluations, summaries, strict=True):
                yield name, unit, one.controller, *(number(summary[name][key]) for key in ("median", "q95", "max"))
    for name, kept in (("lost episodes", "lost"), ("successful episodes", "success")):
        for one in evaluations:
            values = getattr(one, kept)
            yield name, f"of {len(values)}", one.controller, str(sum(values)), "", ""
    for one in evaluations:
        yield "return, mean", "", one.controller, f"{np.mean(one.returns[1.0] or [np.nan]):.4g}", "", ""


def table(evaluations: Sequence[Evaluation]) -> str:
    """The metrics in Markdown: a row per metric, three columns per controller."""
    head = ["metric", "unit", *(text for one in evaluations for text in (f"{one.controller}: median", "95 %", "max"))]
    lines = []
    for name, rows in groupby(_metrics(evaluations), key=itemgetter(0)):
        line = [name, UNITS.get(name, "")]
        for _, unit, _, value, *others in rows:
            line += [value if line[1] else f"{value} {unit}".rstrip(), *others]
        lines.append(line)
    return markdown(head, lines)


def data(evaluations: Sequence[Evaluation]) -> str:
    """The metrics as CSV with the columns ``DATA``."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([DATA, *_metrics(evaluations)])
    return text.getvalue()
