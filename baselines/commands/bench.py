"""birthsim-bench: how fast things are here, each figure beside what it is to be compared with, in one run."""

from __future__ import annotations

import argparse
import os
import platform
import re
import time
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any

import gymnasium
import numba
import numpy as np
from scipy.integrate import solve_ivp

import birthsim_env
from baselines.bench.comparison import default_controllers
from baselines.commands.shared import run
from baselines.files import make_folder, write_json
from baselines.registry import make_controller
from birthsim_env.physics import dynamics
from birthsim_env.physics.lanes import Array

POLICY_PERIOD = 0.01
PERIODS = 50
"""Control periods from which a controller's signals are taken: twelve samples of the laboratory's tracker."""
STEPS_PER_PERIOD = round(POLICY_PERIOD / dynamics.INTEGRATION_STEP)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim-bench", description="Measure the speed of plant, environments and law.")
    parser.add_argument("--seconds", type=float, default=1.0, help="time per measurement (default: %(default)s)")
    parser.add_argument("--out", type=Path, help="folder for bench.json")
    run(parser, _bench)


def seconds_per_call(call: Callable[[], Any], budget: float) -> float:
    """Median time of one call over about ``budget`` seconds, after one call that may compile."""
    call()
    spent: list[float] = []
    until = time.perf_counter() + budget
    while time.perf_counter() < until or len(spent) < 3:
        started = time.perf_counter()
        call()
        spent.append(time.perf_counter() - started)
    return float(np.median(spent))


def packed_share() -> tuple[int, int]:
    """Divisions and square roots of doubles in the integrator's machine code: (packed, scalar) instructions; x86 only."""
    # Machine code from the cache cannot be inspected, so the integrator is compiled once more.
    advance: Any = dynamics.advance
    compiled = numba.njit(error_model="numpy", nogil=True)(advance.py_func)
    compiled.compile(advance.signatures[0])
    code = "\n".join(compiled.inspect_asm().values())
    return len(re.findall(r"\bv?(?:div|sqrt)pd\b", code)), len(re.findall(r"\bv?(?:div|sqrt)sd\b", code))


def _kernel(lanes: int, budget: float) -> float:
    plant = birthsim_env.Plant(num_envs=lanes)
    command = np.random.default_rng(0).uniform(-0.05, 0.05, (4, lanes))
    forces, start = np.zeros((10, 2, lanes)), plant.state.copy()

    def policy_step() -> None:
        plant.state[:] = start
        plant.advance_unchecked(command, forces, POLICY_PERIOD)

    return lanes / seconds_per_call(policy_step, budget)


def _single(budget: float) -> float:
    env = gymnasium.make("BirthSIM/Circle-v1")
    env.reset(seed=0)
    actions = cycle(_random_openings().astype(np.float32))

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return 1 / seconds_per_call(step, budget)


def _random_openings() -> Array:
    """Openings (100, 4) that keep the air moving and the pistons away from the end stops for a second."""
    return np.random.default_rng(0).uniform(-0.3, 0.3, (100, 4))


def _scipy(budget: float) -> float:
    plant, force = birthsim_env.Plant(), np.zeros((2, 1))
    openings, start = cycle(_random_openings()), plant.state.copy()
    scale = np.repeat([1e-9, 1e-6, 1e-2, 1e-3], [4, 2, 8, 4])
    scale[6:14] = np.tile([1e-1, 1e-4], 4)

    def policy_step() -> None:
        command = next(openings)[:, None]

        def rates(_: float, state: Array) -> Array:
            return plant.derivatives(state[:, None], command, force)[:, 0]

        solution = solve_ivp(rates, (0.0, POLICY_PERIOD), plant.state[:, 0], rtol=1e-6, atol=scale)
        plant.state[:, 0] = solution.y[:, -1]
        if np.abs(plant.piston).max() > 0.08:
            plant.state[:] = start

    return 1 / seconds_per_call(policy_step, budget)


def _vector(environment: str, lanes: int, budget: float) -> float:
    env = gymnasium.make_vec(environment, num_envs=lanes)
    env.reset(seed=0)
    actions = np.zeros(env.action_space.shape or (), dtype=np.float32)
    return lanes / seconds_per_call(lambda: env.step(actions), budget)


def _control(name: str, sensors: str, lanes: int, budget: float) -> float:
    """us per lane and call of a controller on what it met in the first ``PERIODS`` control periods of its own run."""
    rig = birthsim_env.Parameters()
    law = make_controller(name, rig)
    period = rig.electronics.control_period
    env: Any = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=lanes, policy_period=period, sensors=sensors)
    env.reset(seed=0)
    met = []
    for _ in range(PERIODS):
        met.append((env.measurement, env.reference))
        env.step(law.command(*met[-1]).T)
    signals = cycle(met)
    return seconds_per_call(lambda: law.command(*next(signals)), budget) / lanes * 1e6


def _frames(environment: str, budget: float) -> float:
    """Frames per second, each of them after another step."""
    # CartPole looks for a screen and a loudspeaker, and says so where there are none.
    os.environ.update(SDL_VIDEODRIVER="dummy", SDL_AUDIODRIVER="dummy", PYGAME_HIDE_SUPPORT_PROMPT="1")
    env = gymnasium.make(environment, render_mode="rgb_array")
    env.reset(seed=0)
    env.action_space.seed(0)
    env.render()
    spent: list[float] = []
    while sum(spent) < budget:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
        started = time.perf_counter()
        env.render()
        spent.append(time.perf_counter() - started)
    env.close()
    return 1 / float(np.median(spent))


def _bench(arguments: argparse.Namespace) -> None:
    if not arguments.seconds > 0:
        raise ValueError(f"--seconds {arguments.seconds!r}; allowed: a positive number")
    budget = arguments.seconds
    kernel, lane = _kernel(1024, budget), _kernel(1, budget)
    packed, scalar = packed_share()
    single, reference = _single(budget), _scipy(budget)
    ours, theirs = _frames("BirthSIM/Circle-v1", budget), _frames("CartPole-v1", budget)
    rows: list[tuple[str, float, str]] = [
        ("plant, 1024 lanes, one core", kernel, "policy steps/s (10 ms = 40 RK4 steps)"),
        ("  per right-hand side and lane", 1e9 / kernel / STEPS_PER_PERIOD / 4, "ns"),
        ("plant, 1 lane", lane, "policy steps/s"),
        ("  ratio: a lane among 1024 to a lane alone", kernel / lane, "times"),
        (
            "  packed divisions and roots in the machine code",
            packed,
            f"instructions, beside {scalar} scalar ones for remainders",
        ),
        ("gym.make step, valve mode", single, "policy steps/s"),
        ("  the same plant through solve_ivp (RK45, rtol 1e-6)", reference, "policy steps/s"),
        ("  ratio", single / reference, "times"),
        ("gym.make_vec step, 128 lanes", _vector("BirthSIM/Circle-v1", 128, budget), "policy steps/s"),
        ("gym.make_vec step, 1024 lanes", _vector("BirthSIM/Circle-v1", 1024, budget), "policy steps/s"),
        ("backstepping, 1 lane", _control("backstepping", "ideal", 1, budget), "us per call"),
        *(
            (f"{name}, {sensors} sensors, batch of 256", _control(name, sensors, 256, budget), "us per lane and call")
            for name in default_controllers()
            for sensors in ("ideal", "lab")
        ),
        ("rgb_array frame, 640 x 480", ours, "frames/s"),
        ("  Gymnasium's CartPole-v1, 600 x 400", theirs, "frames/s"),
        ("  ratio", ours / theirs, "times"),
    ]
    print(f"{platform.machine()}, Python {platform.python_version()}, one thread; medians over {budget:g} s each\n")
    for name, value, unit in rows:
        print(f"{name:56}{value:>14,.4g}  {unit}" if value < 1000 else f"{name:56}{value:>14,.0f}  {unit}")
    if arguments.out is not None:
        write_json(make_folder(arguments.out) / "bench.json", [{"what": n.strip(), "value": v, "unit": u} for n, v, u in rows])


if __name__ == "__main__":
    main()
