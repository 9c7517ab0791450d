"""Evaluations on a device: all episodes run there side by side, with the metrics of ``baselines.bench.evaluation``."""

import copy
from typing import Any, Unpack

import gymnasium
import numpy as np
from tqdm import tqdm

from baselines.bench.evaluation import AT_ONCE, Evaluation, times_of
from baselines.bench.feasibility import required_strength_ratio
from baselines.bench.measures import DISCOUNTS, Measures
from baselines.bench.metrics import metrics_of
from baselines.controller import CommandFunction, Controller, controller_of
from baselines.driving import driving
from birthsim_build.device.lanes import Lanes
from birthsim_build.device.loops import pieces_of
from birthsim_build.device.machine import machine_named
from birthsim_build.device.program import Pieces
from birthsim_env.assembly import Arguments, spelled_out
from birthsim_env.physics.rig.parameters import load_parameters


@spelled_out("policy_period", "actuation")
def evaluate_on(
    device: str,
    environment: str,
    controller: Controller | CommandFunction,
    name: str,
    episodes: int,
    seed: int,
    progress: bool = True,
    **arguments: Unpack[Arguments],
) -> Evaluation:
    """``evaluate`` on a ``device``: equal in every bit, but that ``traces`` are one. ``cost`` is the controller's time here.

    Worlds are drawn here. Raises ``ValueError`` for a controller, or an argument of the environment, that is not compiled.
    """
    machine, law = machine_named(device), controller_of(controller)
    like = _begun(environment, copy.deepcopy(law), name, [seed] * (1 if episodes > 1 else 2), copy.deepcopy(arguments))
    seeds = list(range(seed, seed + episodes))
    env, measures, pieces = _begun(environment, law, name, seeds, arguments)
    asked, simulation, lanes = required_strength_ratio(env), env.simulation, Lanes(machine, pieces, like[2], episodes)
    pairs = [(view, array) for view, array in zip(lanes.views, pieces.arrays(), strict=True) if view is not None]
    for view, array in pairs:
        view[...] = machine.arrays.asarray(array)
    steps, title = range(0, env.steps, AT_ONCE), f"{name}, {episodes} episodes"
    for step in tqdm(steps, desc=title, unit=" steps", disable=not progress, leave=False):
        missed = lanes.advance(min(AT_ONCE, env.steps - step))
        if missed or step + AT_ONCE >= env.steps:
            for view, array in pairs:
                array[...] = machine.local(view)
        if missed:
            simulation.actuation.explain(simulation.measurement, simulation.reference)
    own, returns = measures.own, dict(zip(DISCOUNTS, measures.own.returns.tolist(), strict=True))
    metrics = {metric: values.tolist() for metric, values in metrics_of(own, simulation.period).items()}
    lost, success = (own.alive == 0.0).tolist(), (own.success > 0.0).tolist()
    traces = [measures.error.transpose(0, 2, 1)]
    cost = float(np.median(times_of(simulation.actuation, simulation)))
    return Evaluation(name, seeds, metrics, lost, asked.tolist(), returns, success, cost, traces)


def _begun(
    environment: str, controller: Controller, name: str, seeds: list[int], arguments: Arguments
) -> tuple[Any, Measures, Pieces]:
    """An environment whose episodes have begun, what is measured in it, and its loop with the stages that measure."""
    period = load_parameters(arguments.get("parameters")).electronics.control_period
    driver = driving(controller, name)
    env: Any = gymnasium.make_vec(environment, num_envs=len(seeds), policy_period=period, actuation=driver, **arguments)
    env.reset(seed=seeds)
    measures = Measures(env.simulation, env.steps)
    return env, measures, pieces_of(env.simulation)
