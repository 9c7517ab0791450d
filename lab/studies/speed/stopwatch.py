"""Times environments through Gymnasium alone, in a process of its own that is told line by line what to measure.

A job is a line of JSON, {"kind": name of a function here, its arguments}; the answer is a line too. The file runs under any
checkout of the project that PYTHONPATH names, so it imports nothing of it but the package that registers the ids and what
evaluates laws.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator
from itertools import cycle
from typing import Any

import gymnasium
import numpy as np

import agents as agents  # registers ids with a controller inside
import birthsim_env

CLOCKS = {"cpu": time.process_time, "wall": time.perf_counter}


def seconds_per_call(call: Callable[[], Any], budget: float, clock: str = "cpu") -> float:
    """Median time of one call over about ``budget`` seconds, after one call that may compile."""
    now = CLOCKS[clock]
    call()
    spent: list[float] = []
    until = now() + budget
    while now() < until or len(spent) < 3:
        started = now()
        call()
        spent.append(now() - started)
    return float(np.median(spent))


def step(environment: str, budget: float, **arguments: Any) -> float:
    """CPU s per step of a single environment."""
    env = gymnasium.make(environment, **arguments)
    env.reset(seed=0)
    actions = _actions(env.action_space, 100)

    def act() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return seconds_per_call(act, budget)


def vector_step(environment: str, lanes: int, budget: float, clock: str = "cpu", **arguments: Any) -> float:
    """s per lane and step of a vector environment."""
    env = gymnasium.make_vec(environment, num_envs=lanes, **arguments)
    env.reset(seed=0)
    actions = _actions(env.action_space, 10)
    return seconds_per_call(lambda: env.step(next(actions)), budget, clock) / lanes


def evaluation(environment: str, law: str, lanes: int, budget: float, **arguments: Any) -> float:
    """CPU s per lane and 10 ms of an evaluation with all that it measures, of episodes of 16 s."""
    from baselines import make_controller
    from baselines.bench.evaluation import evaluate

    def run() -> None:
        evaluate(environment, make_controller(law, birthsim_env.Parameters()), law, lanes, 0, False, duration=16.0, **arguments)

    return seconds_per_call(run, budget) / lanes / 1600


def vector_reset(environment: str, lanes: int, budget: float, **arguments: Any) -> float:
    """CPU s per lane of a reset without a seed."""
    env = gymnasium.make_vec(environment, num_envs=lanes, **arguments)
    env.reset(seed=0)
    return seconds_per_call(env.reset, budget) / lanes


def first_step(environment: str, **arguments: Any) -> float:
    """CPU s from the start of this process to the end of an environment's first step."""
    env = gymnasium.make(environment, **arguments)
    env.reset(seed=0)
    env.step(np.zeros(env.action_space.shape or (), dtype=np.float32))
    return time.process_time()


def _actions(space: gymnasium.Space[Any], count: int) -> Iterator[Any]:
    """Random actions that keep the air moving and the pistons away from the end stops for a second."""
    return cycle(np.random.default_rng(0).uniform(-0.3, 0.3, (count, *(space.shape or ()))).astype(np.float32))


def main() -> None:
    """Says which package it measures, then answers jobs until there are no more."""
    kinds: dict[str, Callable[..., float]] = {
        kind.__name__: kind for kind in (step, vector_step, evaluation, vector_reset, first_step)
    }
    print(json.dumps(birthsim_env.__file__), flush=True)
    for line in sys.stdin:
        job = json.loads(line)
        print(json.dumps(kinds[job.pop("kind")](**job)), flush=True)


if __name__ == "__main__":
    main()
