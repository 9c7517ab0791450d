"""Where a memory helps policies that learn by gradients: the same training with and without one, at two periods, and told its
rig, with ideal sensors on rigs of every size and with honest sensors on those of the default ranges.

All trainings have about the same CPU time, as many weights, and the same lanes, rollouts and horizon, those of the
configuration in seconds."""

import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from agents.policy.files import read_policy
from agents.residual.privileged import PolicyFunction, acting
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings, load_configuration, override
from agents.training.trainer import train
from agents.training.validation import Score, validate
from baselines.bench.statistics import LOST_ERROR, jsonable, quantile
from baselines.network import Acting
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, SPREAD_AND_WORST, Cell, Head, markdown
from lab.engine.worlds import worlds

CONFIGURATION = "circle_recurrent_apg"

WORLDS = {"every size, ideal": ("ideal", "examples/wide_rig.toml"), "default ranges, honest": ("honest", None)}
"""Rigs and sensors in words -> the sensors, and the rig's file."""

STEPS = {0.01: 400_000, 0.004: 700_000}
"""Period of a policy (s) -> policy steps of a training, which takes about a minute of CPU time."""

POLICIES = {"no memory": (0, False), "32 cells": (32, False), "no memory, told its rig": (0, True)}
"""A policy in words -> cells of its memory, and whether it is privileged."""

TOLD_AT = 0.01
"""s: the only period at which policies are told their rig."""

HIDDEN = (64, 64)
"""Hidden layers of a policy without a memory, which then has about as many weights."""

LAW = "admittance-adaptive"
"""The controller beside them, which believes the default rig."""

STRENGTH, FAR = 0.9, 5.0
"""Worlds that ask for a larger fraction of their rig's strength are left out; mm, and what is too much of an error; assumed."""

FORGETS = 0.5
"""s: how often a memory is wiped to see what it is for."""


def settings_of(sensors: str, cells: int, told: bool, period: float, trained: int) -> tuple[TrainingSettings, ResidualSettings]:
    """A training of the study, whose seed is ``trained``."""
    training, residual = load_configuration(CONFIGURATION)
    longer = residual.policy_period / period
    own = {name: round(getattr(training, name) * longer) for name in ("rollout", "horizon")}
    size = {"memory": cells, "hidden": training.hidden if cells else HIDDEN}
    more = {"sensors": sensors, "privileged": told, "steps": STEPS[period], "validations": 2, "seed": trained}
    return override(training, **own, **size, **more), override(residual, policy_period=period)


def learn(
    sensors: str, rig: dict[str, Any], cells: int, told: bool, period: float, trained: int, episodes: int, seed: int
) -> Result:
    """A policy that is trained anew: what it reaches in worlds from ``seed`` on, and in the same ones where its memory is wiped
    every ``FORGETS`` s; the CPU time of its training, s, and its weights."""
    parameters = Parameters.from_dict(rig)
    training, residual = settings_of(sensors, cells, told, period, trained)
    began = time.process_time()
    with tempfile.TemporaryDirectory() as place:
        train(training, residual, Path(place), parameters)
        spent, network = time.process_time() - began, read_policy(place).network
    weights = sum(array.size for one in (*network.layers, *network.memory) for array in one)

    def score(act: PolicyFunction) -> Result:
        return _measured(sensors, parameters, residual, lambda env: acting(act, env, told), episodes, seed)

    wiped = {"wiped": score(_forgetful(network.acting(), round(FORGETS / period)))} if cells else {}
    return {"own": score(network.acting()), **wiped, "seconds": spent, "weights": weights}


def beside(sensors: str, rig: dict[str, Any], episodes: int, seed: int) -> Result:
    """What ``LAW`` reaches alone in the same worlds."""

    def zero(env: Any) -> PolicyFunction:
        return lambda seen: np.zeros((len(seen), *env.single_action_space.shape), dtype=np.float32)

    return {"own": _measured(sensors, Parameters.from_dict(rig), ResidualSettings(LAW), zero, episodes, seed)}


def _measured(
    sensors: str, rig: Parameters, residual: ResidualSettings, act: Callable[[Any], PolicyFunction], episodes: int, seed: int
) -> Result:
    made: dict[str, Any] = {"parameters": rig, "sensors": sensors, "randomize": True, "autoreset_mode": AutoresetMode.SAME_STEP}
    env: Any = gymnasium.make_vec("BirthSIM/CircleResidual-v2", num_envs=episodes, **made, **residual.to_dict())
    with closing(env):
        return _figures(validate(env, act(env), seed))


def _forgetful(act: Acting, every: int) -> PolicyFunction:
    """``act`` that forgets all lanes' past every so many steps."""
    steps = 0

    def forgets(seen: NDArray[np.float32]) -> NDArray[np.float32]:
        nonlocal steps
        if steps % every == 0:
            act.reset()
        steps += 1
        return act(seen)

    return forgets


def _figures(score: Score) -> Result:
    """Settled errors, mm, over worlds within their rig's strength; how many are far off, and lost; stiffness errors, %."""
    within = score.required_strength_ratio <= STRENGTH
    errors, stiffness = score.error[within], score.stiffness[within]
    shares = {name: quantile(errors, share) for name, share in (("median", 0.5), ("q95", 0.95), ("worst", 1.0))}
    felt = {name: quantile(stiffness, share) for name, share in (("stiffness", 0.5), ("stiffness95", 0.95))}
    lost = int((errors >= LOST_ERROR).sum())
    return jsonable({**shares, **felt, "far": int((errors > FAR).sum()), "lost": lost, "of": len(errors)})  # type: ignore[no-any-return]


def _kinds() -> list[tuple[str, str, float]]:
    """Worlds, policies and periods of the table."""
    found = list(product(WORLDS, POLICIES, STEPS))
    return [(where, who, period) for where, who, period in found if not POLICIES[who][1] or period == TOLD_AT]


def _tasks(options: Options) -> dict[Any, Task]:
    tasks, judged = {}, {"episodes": options.episodes, "seed": options.seed}
    rigs = {where: load_parameters(ROOT / file if file else None).to_dict() for where, (_, file) in WORLDS.items()}
    for number, (where, (sensors, _)) in enumerate(WORLDS.items()):
        tasks[where, LAW, 0.0, 0] = Task(f"law-{number}", beside, {"sensors": sensors, "rig": rigs[where], **judged})
    # Every training with the first seed, then those with the others.
    for trained, (where, who, period) in product(options.trained, _kinds()):
        cells, told = POLICIES[who]
        own = {"sensors": WORLDS[where][0], "rig": rigs[where], "cells": cells, "told": told, "period": period}
        name = f"{own['sensors']}-{cells}{'-told' if told else ''}-{1e3 * period:g}ms-{trained}"
        tasks[where, who, period, trained] = Task(name, learn, {**own, "trained": trained, **judged})
    return tasks


def _kept(options: Options, found: Found) -> Any:
    names = ("worlds", "policy", "period", "trained")
    return [{**dict(zip(names, key, strict=True)), **found[key]} for key in sorted(found, key=_order)]


def _order(key: tuple[str, str, float, int]) -> tuple[int, ...]:
    where, who, period, trained = key
    place = [LAW, *POLICIES].index(who)
    return list(WORLDS).index(where), place, list((0.0, *STEPS)).index(period), trained


def _shown(content: Content) -> dict[str, str]:
    head: list[Cell | Head] = [
        "rigs, sensors",
        "policy",
        "period, ms",
        "seed",
        Head("settled error, mm", SPREAD_AND_WORST),
        f"beyond {FAR:g} mm",
        f"lost or {LOST_ERROR:g} mm off",
    ]
    head += [Head("along the push, %", SPREAD), Head("wiped, mm", SPREAD), "CPU s"]
    rows = [head]
    for one in content["figures"]:
        own, learned = one["own"], one["period"] > 0
        error, push = ([own[name] for name in names] for names in (("median", "q95", "worst"), ("stiffness", "stiffness95")))
        wiped = [one["wiped"][name] for name in ("median", "q95")] if "wiped" in one else "-"
        period, trained, spent = (
            (f"{1e3 * one['period']:g}", str(one["trained"]), f"{one['seconds']:.0f}") if learned else ("1", "-", "-")
        )
        who = one["policy"] if learned else f"`{LAW}`"
        counts = [f"{own['far']} of {own['of']}", str(own["lost"])]
        rows.append([one["worlds"], who, period, trained, error, *counts, push, wiped, spent])
    drawn = worlds(content["settings"]["seed"], content["settings"]["episodes"])
    said = f"{drawn}, of which those count that ask for at most {100 * STRENGTH:g} % of the rig's strength."
    return {"memory.md": f"{said}\n\n{markdown(rows)}\n"}


STUDY = Study(
    {"trained": (1,), "episodes": 256, "seed": 997000},
    _tasks,
    _kept,
    {"median": "mm", "q95": "mm", "worst": "mm", "stiffness": "%", "stiffness95": "%", "seconds": "s"},
    _shown,
    words={"trained": "seeds of trainings"},
)
register(study="memory", about="where a memory helps policies by gradients")(STUDY)
