"""Training of residual policies by reinforcement learning or by gradients, several seeds in one call or command."""

import os
import sys
from contextlib import ExitStack
from dataclasses import dataclass, fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents.policy.files import Policy
from agents.policy.seeds import load_policy
from agents.reader.settings import is_reader
from agents.residual.settings import LAWS, ResidualSettings
from agents.training.configuration import TrainingSettings, load_configuration, override
from agents.training.interruption import WORDS, Interrupted
from agents.training.time_split import shares
from baselines.work.side_by_side import side_by_side
from birthsim import reading
from birthsim.command_line.settings import JOBS_AT_MOST
from birthsim.command_line.worlds import check_environment, check_world
from birthsim_env.endings import one_signal_later
from birthsim_env.extras import installation
from birthsim_env.files import make_folder, own_folder, temporary_folder, write_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import checked_count, near, path_of, shown
from birthsim_env.splits import TRAIN, VALIDATION, split_of


@dataclass(frozen=True)
class Plan:
    """Trainings of several seeds that have been looked at, and how many of them run side by side."""

    training: TrainingSettings
    residual: ResidualSettings
    rig: Parameters
    seeds: tuple[int, ...]
    jobs: int
    out: Path


@dataclass(frozen=True)
class Trained:
    """What a training reached.

    Parameters
    ----------
    folder : Path
        Where each seed has a folder ``seed_N`` with its policy, checkpoint, curve and events.
    reached : dict
        Seed -> what its ``training.json`` holds: ``policy``, ``law`` and ``paper`` with ``pooled_mm``, the settled RMS error
        over all validation episodes, ``tail_mm``, its 95th percentile, and ``lost``, the number of lost episodes; ``curve``,
        a list with the same of every validation, ``steps`` and ``seconds``; ``settings``.

    Examples
    --------
    ``train`` returns one.

    >>> import birthsim, pathlib
    >>> trained = birthsim.Trained(pathlib.Path("out"), {0: {"policy": {"pooled_mm": 1.2}}})
    >>> trained.reached[0]["policy"]["pooled_mm"]
    1.2
    """

    folder: Path
    reached: dict[int, dict[str, Any]]

    @property
    def policy(self) -> Policy:
        """The policy of the seed that did best in validation."""
        return load_policy(self.folder)


def train(
    config: str | os.PathLike[str] = "circle",
    *,
    out: str | os.PathLike[str],
    seed: int | None = None,
    seeds: int = 1,
    jobs: int = 1,
    parameters: Any = None,
    **changes: Any,
) -> Trained:
    """Train residual policies on top of a controller, as ``birthsim train`` does.

    Parameters
    ----------
    config : str or path
        A configuration that comes with the package, such as ``"circle"`` or ``"circle_quick"``, or a TOML file with tables
        ``[training]`` and ``[residual]``. One with a table ``[reader]``, as ``"rig_reader"``, teaches a network that reads the
        rig, for ``admittance[reader=FILE]``; ``changes`` are then fields of ``agents.reader.settings.ReaderSettings``.
    out : str or path
        Folder; each seed has one in it. Where it holds a training of the same settings that was interrupted, that goes on, and
        ends with the same policy, checkpoint and events as one that never was.
    seed : int, optional
        First seed, else the configuration's.
    seeds : int
        Number of seeds, one after the other from ``seed`` on.
    jobs : int
        Seeds that are trained side by side, each in a process of its own.
    parameters : Parameters, path, mapping or None
        The rig, as environments take it.
    **changes
        Fields of ``agents.TrainingSettings`` and ``agents.ResidualSettings`` instead of what the configuration says, such as
        ``environment``, ``algorithm`` (``"ppo"``, ``"recurrent-ppo"``, ``"sac"``, ``"tqc"`` or ``"apg"``, which brings its own
        hyperparameters), ``steps`` (policy steps), ``law``, ``authority`` (N).

    Returns
    -------
    Trained
        The folder, what each seed reached, and the best policy.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed; also where the extra ``agents`` is missing, and where ``out`` holds
        a training with other settings.
    KeyboardInterrupt
        After Ctrl-C, at the end of the update in which it came, once a checkpoint is written; a second one comes at once.

    Notes
    -----
    A policy corrects its controller by forces of at most ``authority``, and is kept whenever it improves on validation worlds;
    docs/learning.md says how, and what came of it.

    Examples
    --------
    A training that is much too short to learn anything:

    >>> import birthsim, tempfile
    >>> tiny = {"lanes": 2, "rollout": 8, "batch": 8, "epochs": 1, "hidden": (8,), "validation_lanes": 2, "validations": 1}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     probe = {"environment": "BirthSIM/ProbeResidual-v3", "policy_period": 0.1}
    ...     trained = birthsim.train("circle", out=folder, steps=16, **probe, **tiny)
    ...     trained.policy.environment
    'BirthSIM/ProbeResidual-v3'
    """
    folder = path_of(out)
    if folder is None:
        raise ValueError(f"out = {shown(out)}; allowed: the path of a folder")
    if is_reader(config):
        require_extra()
        own = reading.plan(config, Path(folder), seed, *counted(seeds, jobs), parameters, changes)
        return Trained(own.out, reading.carry_out(own))
    return carry_out(plan(config, Path(folder), seed, seeds, jobs, parameters, changes))


def plan(
    config: str | os.PathLike[str],
    out: Path,
    seed: int | None,
    seeds: int,
    jobs: int,
    parameters: Any,
    changes: dict[str, Any],
) -> Plan:
    """Trainings that can begin; ``ValueError`` names what cannot be."""
    require_extra()
    seeds, jobs = counted(seeds, jobs)
    training, residual = load_configuration(config)
    own = [field.name for field in fields(residual)]
    known = [*(field.name for field in fields(training)), *own]
    for name, value in changes.items():
        if name not in known:
            raise ValueError(f"{name} = {shown(value)} is unknown{near(name, known)}; allowed: {', '.join(known)}")
    residual = override(residual, **{name: value for name, value in changes.items() if name in own})
    given = {} if seed is None else {"seed": seed}
    training = override(training, **given, **{name: value for name, value in changes.items() if name not in own})
    rig = training.rig(parameters)
    for name, hand in training.worlds():
        check_environment(name, residual=True, given="environment =")
        check_world(name, parameters=rig, randomize=training.randomize, sensors=training.sensors, **hand)
    return Plan(training, residual, rig, tuple(range(training.seed, training.seed + seeds)), jobs, make_folder(out))


def require_extra() -> None:
    """Raise ``ValueError`` where what trainings need is missing."""
    missing = [name for name in ("torch", "stable_baselines3") if find_spec(name) is None]
    if missing:
        raise ValueError(f"no {' and no '.join(missing)}; training needs the extra: {installation('agents')}")


def counted(seeds: int, jobs: int) -> tuple[int, int]:
    """Numbers of seeds and processes; ``ValueError`` where they are none."""
    return checked_count("seeds", seeds, 1, 10**6), checked_count("jobs", jobs, 1, JOBS_AT_MOST)


def worlds_of(plan: Plan) -> str:
    """The splits of a plan's worlds in one line, and a warning where a training leaves the split that it learns on."""
    from agents.training.validation import SEED_SPACING, training_seeds  # late: it loads what validates

    lanes = [training_seeds(seed, plan.training.lanes) for seed in plan.seeds]
    said = f"worlds: seeds {lanes[0].start} to {lanes[-1].stop - 1} to learn, of the split {TRAIN.name}; the policy is chosen "
    said += f"by seeds {VALIDATION.first} to {VALIDATION.first + plan.training.validation_lanes - 1}, of {VALIDATION.name}"
    beyond = [seed for seed, own in zip(plan.seeds, lanes, strict=True) if split_of(own) != TRAIN.name]
    if not beyond:
        return said
    most = len(TRAIN.ranges[0]) // SEED_SPACING - 1
    return f"{said}\nwarning: worlds of seed = {beyond[0]} are not of the split {TRAIN.name}; allowed there: 0 to {most}"


def carry_out(plan: Plan) -> Trained:
    """Train every seed; those side by side end, each with a checkpoint, when this process is asked to end."""
    results: dict[int, dict[str, Any] | Interrupted] = {}
    with ExitStack() as stack:
        ending = None
        if min(plan.jobs, len(plan.seeds)) > 1:
            ending = stack.enter_context(temporary_folder()) / "ending"
            stack.enter_context(one_signal_later(WORDS, ending.touch))
        work = [
            (replace(plan.training, seed=seed), plan.residual, plan.out / f"seed_{seed}", plan.rig, k % plan.jobs, ending)
            for k, seed in enumerate(plan.seeds)
        ]
        try:
            side_by_side(_one, work, plan.jobs, results.__setitem__)
        except BaseException:
            if ending:
                print(file=sys.stderr)  # the bar of a process that has been ended has no end of line
            raise
        interrupted = [one for one in results.values() if isinstance(one, Interrupted)]
        print(*interrupted, sep="\n", end="\n" * bool(interrupted), flush=True)
    if interrupted:
        raise OSError("a process that trained was ended; what it has learned is kept, and the same command goes on")
    reached = {seed: one for k, seed in enumerate(plan.seeds) if not isinstance(one := results[k], Interrupted)}
    return Trained(plan.out, reached)


def _one(
    settings: TrainingSettings, residual: ResidualSettings, folder: Path, rig: Parameters, position: int, ending: Path | None
) -> dict[str, Any] | Interrupted:
    from agents.training.trainer import train  # Stable-Baselines3 and torch take three seconds to load

    if ending and ending.exists():
        return Interrupted(f"seed {settings.seed}: interrupted before it began")
    with own_folder(folder):
        try:
            reached = train(settings, residual, folder, rig, position, ending)
        except Interrupted as interrupted:
            if ending is None:
                raise
            return interrupted
        write_json(folder / "training.json", reached)
    return reached


def report(plan: Plan, trained: Trained) -> None:
    """Print what was reached, beside the controller below and the paper's."""
    training, residual, results = plan.training, plan.residual, trained.reached
    law, paper = (results[plan.seeds[0]][name] for name in ("law", "paper"))
    print(
        f"\n{training.environment}, {training.validation_lanes} validation episodes, of which {law['infeasible']} ask for more"
    )
    print("than the rig's strength and are left out; settled RMS error:")
    print(f"{'':26}{'pooled':>10}{'95 %':>10}{'lost':>8}")
    measure = paper or law
    for name, figures in (
        *((("the paper's law", paper),) if paper else ()),
        *(((residual.law, law),) if not paper or residual.law != LAWS[0] else ()),
        *((f"seed {seed}", result["policy"]) for seed, result in results.items()),
    ):
        better = "" if figures in (law, paper) else f"  {100 * (1 - figures['pooled_mm'] / measure['pooled_mm']):3.0f} % below"
        print(f"{name:26}{figures['pooled_mm']:7.2f} mm{figures['tail_mm']:7.2f} mm{figures['lost']:8d}{better}")
    last = [result["curve"][-1] for result in results.values()]
    print(", ".join(f"{point['steps']:,}" for point in last), f"of {training.steps:,} steps;", end=" ")
    seconds = ", ".join(f"{point['seconds']:.0f}" for point in last)
    print(f"{seconds} s per seed with validation; the time of training alone:")
    for seed, result in results.items():
        print(f"seed {seed}: {shares(result['curve'][-1]['split'], result['curve'][-1]['environment_fraction'])}")
