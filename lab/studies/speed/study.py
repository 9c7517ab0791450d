"""How fast things are here, each figure beside what it is to be compared with, in one run."""

import os
import re
import tempfile
import time
from itertools import cycle
from pathlib import Path
from typing import Any

import gymnasium
import numba
import numpy as np
from scipy.integrate import solve_ivp

import birthsim_env
from baselines.driving import driving
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.runge_kutta import STAGES
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown
from lab.studies.comparison.grid import default_controllers
from lab.studies.speed import speeds as speed
from lab.studies.speed.stopwatch import seconds_per_call, step, vector_step
from lab.studies.speed.twin import Twin, has_compiler

POLICY_PERIOD = 0.01
PERIODS = 50
"""Control periods from which a controller's signals are taken: twelve samples of the laboratory's tracker."""
STEPS_PER_PERIOD = round(POLICY_PERIOD / dynamics.INTEGRATION_STEP)

Row = tuple[Any, ...]
"""A row of a table: what, how much (NaN where it cannot be had), and its unit or why it cannot be had; of the environments,
with another checkout, also its figure and how many times as fast this one is."""


def _tasks(options: Options) -> dict[Any, Task]:
    if not options.seconds > 0:
        raise ValueError(f"--seconds {options.seconds!r}; allowed: a positive number")
    if options.beside:
        speed.Process(Path(options.beside)).close()  # says at once what is wrong with it
    own = {"seconds": options.seconds}
    if options.compile:
        return {"first": Task("first", first, {})}
    return {
        "here": Task("here", here, own),
        "environments": Task("environments", environments, {**own, "beside": options.beside}),
    }  # fmt: skip


def packed_fraction() -> tuple[int, int]:
    """Divisions and square roots of doubles in the integrator's machine code: (packed, scalar) instructions; x86 only."""
    # Machine code that the package carries, or from the cache, cannot be inspected: the integrator is compiled once more.
    advance: Any = dynamics.advance
    array, samples = numba.float64[:, ::1], numba.float64[:, :, ::1]
    compiled = numba.njit(error_model="numpy", nogil=True)(advance.py_func)
    compiled.compile((array, array, samples, array, numba.int64, numba.float64, array))
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


def _against_c(lanes: int, budget: float) -> tuple[float, float]:
    """Policy steps/s of the kernel and of its twin in C, by CPU time and in turns; NaN for the twin without a compiler."""
    plant = birthsim_env.Plant(num_envs=lanes)
    command = np.random.default_rng(0).uniform(-0.05, 0.05, (4, lanes))
    forces, start = np.zeros((1, 2, lanes)), plant.state.copy()
    advances: list[Any] = [dynamics.advance]
    if has_compiler():
        with tempfile.TemporaryDirectory() as folder:
            advances.append(Twin(Path(folder)).advance)
    spent: list[list[float]] = [[] for _ in advances]
    until = time.process_time() + budget
    while time.process_time() < until or len(spent[0]) < 4:
        for advance, times in zip(advances, spent, strict=True):
            plant.state[:] = start
            started = time.process_time()
            advance(
                plant.state, command, forces, plant.lane_parameters, STEPS_PER_PERIOD, dynamics.INTEGRATION_STEP, plant.impacts
            )
            times.append(time.process_time() - started)
    speeds = [lanes / float(np.median(times[1:])) for times in spent]
    return speeds[0], speeds[1] if has_compiler() else float("nan")


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


def _control(name: str, sensors: str, lanes: int, budget: float) -> float:
    """us per lane and call of a controller on what it met in the first ``PERIODS`` control periods of its own run."""
    rig = birthsim_env.Parameters()
    law = make_controller(name, rig)
    env: Any = gymnasium.make_vec(
        "BirthSIM/Circle-v2",
        num_envs=lanes,
        policy_period=rig.electronics.control_period,
        sensors=sensors,
        actuation=driving(make_controller(name, rig), name),
    )
    env.reset(seed=0)
    met = []
    for _ in range(PERIODS):
        met.append((env.measurement, env.reference))
        env.step(np.zeros((lanes, 0)))
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
        started = time.process_time()
        env.render()
        spent.append(time.process_time() - started)
    env.close()
    return 1 / float(np.median(spent))


def here(seconds: float) -> Result:
    """Rows of plant, environments, controllers and frames, measured in this process, CPU time."""
    budget = seconds
    kernel, lane = _kernel(1024, budget), _kernel(1, budget)
    packed, scalar = packed_fraction()
    numba_speed, c_speed = _against_c(256, budget)
    single, reference = 1 / step(speed.CIRCLE, budget), _scipy(budget)
    ours, theirs = _frames("BirthSIM/Circle-v2", budget), _frames("CartPole-v1", budget)
    rows: list[Row] = [
        ("plant, 1024 lanes", kernel, "policy steps/s (10 ms = 30 Runge-Kutta steps)"),
        ("per right-hand side and lane", 1e9 / kernel / STEPS_PER_PERIOD / STAGES, "ns"),
        ("plant, 1 lane", lane, "policy steps/s"),
        ("ratio: a lane among 1024 to a lane alone", kernel / lane, "times"),
        (
            "packed divisions and roots in the machine code",
            packed,
            f"instructions, beside {scalar} scalar ones for remainders",
        ),
        ("plant, 256 lanes", numba_speed, "policy steps/s"),
        (
            "the same equations in C by hand, gcc -O3 -ffast-math",
            c_speed,
            "policy steps/s" if has_compiler() else "no C compiler",
        ),
        ("ratio: kernel to C", numba_speed / c_speed, "times"),
        ("gym.make step, valve mode", single, "policy steps/s"),
        ("the same plant through solve_ivp (RK45, rtol 1e-6)", reference, "policy steps/s"),
        ("ratio", single / reference, "times"),
        ("gym.make_vec step, 128 lanes", 1 / vector_step(speed.CIRCLE, 128, budget, num_threads=1), "policy steps/s"),
        ("gym.make_vec step, 1024 lanes", 1 / vector_step(speed.CIRCLE, 1024, budget, num_threads=1), "policy steps/s"),
        ("backstepping, 1 lane", _control("backstepping", "ideal", 1, budget), "us per call"),
        *(
            (f"{name}, {sensors} sensors, batch of 256", _control(name, sensors, 256, budget), "us per lane and call")
            for name in default_controllers()
            for sensors in ("ideal", "lab")
        ),
        ("rgb_array frame, 640 x 480", ours, "frames/s"),
        ("Gymnasium's CartPole-v1, 600 x 400", theirs, "frames/s"),
        ("ratio", ours / theirs, "times"),
    ]
    return {"rows": rows}


def environments(seconds: float, beside: str) -> Result:
    """Rows of the environments, CPU time in processes of their own, each with that of another checkout if one is given."""
    trees = (speed.HERE, *((Path(beside),) if beside else ()))
    measured = speed.measured((*speed.SHARED, *speed.LANES, *speed.THREADS), trees, seconds)
    ours = {name: value for (tree, name), value in measured.items() if tree == speed.HERE}
    rows: list[Row] = [(job.name, *job.in_unit(ours[job.name])) for job in (*speed.SHARED, *speed.LANES, *speed.THREADS)]
    if beside:
        theirs = {job.name: measured[trees[1], job.name] for job in speed.SHARED}
        other = {job.name: (job.in_unit(theirs[job.name])[0], theirs[job.name] / ours[job.name]) for job in speed.SHARED}
        rows = [(*row, *other.get(row[0], ())) for row in rows]
    one, two = (ours[job.name] for job in speed.THREADS)
    return {
        "rows": [*rows, ("ratio: two threads to one", one / two, "times")],
        "trees": [speed.version_of(tree) for tree in trees],
    }


def first() -> Result:
    """Rows of first steps, prebuilt, compiled and cached."""
    return {"rows": [(name, seconds, "s") for name, seconds in speed.first_steps()]}


def _kept(_: Options, found: Found) -> Any:
    return dict(found)


TITLES = {
    "here": "CPU time of one thread, medians over {seconds:g} s each.",
    "environments": "Environments, CPU time, medians of processes that take turns.",
    "first": "CPU time of new processes to the end of their first steps, one after another.",
}


def _shown(content: Content) -> dict[str, str]:
    parts = [content["processor"]]
    for key, found in content["figures"].items():
        head = ["what", "speed", "unit"]
        if len(found.get("trees", ())) > 1:
            head = ["what", *found["trees"], "times as fast", "unit"]
        rows = [[row[0], *map(_number, (row[1], *row[3:])), *[""] * (len(head) - len(row)), row[2]] for row in found["rows"]]
        parts += [TITLES[key].format(**content["settings"]), markdown([head, *rows])]
    return {"speed.md": "\n\n".join(parts) + "\n"}


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:,.0f}" if value >= 1000 else f"{value:,.4g}"


STUDY = Study(
    {"seconds": 1.0, "beside": "", "compile": False},
    _tasks,
    _kept,
    {},
    _shown,
    timed=True,
    words={
        "seconds": "time per measurement",
        "beside": "a checkout of another commit to measure in turns with this one",
        "compile": "measure instead how long first steps take, prebuilt, compiled and cached",
    },
)
register(study="speed", about="speeds, beside what they are to be compared with")(STUDY)
