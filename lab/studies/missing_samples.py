"""What a rig does while a sensor is silent: ``birthsim study missing-samples``.

On circles of randomised rigs all samples of one signal are NaN for some time, from 1 s on. The
table has the largest distance, mm, of the end effector from where it is with all samples, until 0.5 s after the outage: median
and 95th percentile over worlds, and how many heads are lost. The control does not end meanwhile (``fault_time=10``), because
the table shows for how long the last good sample can stand in for the signal. Below it: what the guard costs in a period, as
a ratio in one run.
"""

import time
from dataclasses import dataclass
from typing import Annotated

import gymnasium
import numpy as np

from baselines.named import make_controller
from baselines.staged import StagedController
from birthsim.command_line.settings import MANY, Configured, Sensors, whole
from birthsim_env import Parameters
from birthsim_env.loop.signals import Mask, Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.registry import register

CONTROLLERS = ("backstepping-weight", "pid", "admittance-backstepping", "admittance-adaptive", "residual:circle_lab")
OUTAGES = (0.001, 0.01, 0.03, 0.1, 0.3)
"""s."""
SILENT = ("position", "velocity", "pressures", "user_force")
SEED, BEGINS, AFTER, PERIOD = 991_000, 1.0, 0.5, 0.001
"""``guard.FAULT_TIME`` was chosen on the worlds from seed 990000; those from this one judged it."""


def run(controller: str, sensors: str, signal: str | None, lasts: float, lanes: int, duration: float) -> tuple[Array, Mask]:
    """Positions (T, 2, N), m, and which heads are lost (N,), with ``signal`` NaN from ``BEGINS`` on for ``lasts`` s."""
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=lanes, sensors=sensors, randomize=True, policy_period=PERIOD)
    env.reset(seed=SEED)
    rig: Parameters = env.unwrapped.parameters  # type: ignore[attr-defined]
    law, lost, path = make_controller(controller, rig), np.zeros(lanes, dtype=bool), []
    if isinstance(law, StagedController):
        law.protect(fault_time=10.0)
    for tick in range(round(duration / PERIOD)):
        measured: Measurement = env.unwrapped.measurement  # type: ignore[attr-defined]
        if signal is not None and BEGINS <= tick * PERIOD < BEGINS + lasts - 1e-9:
            getattr(measured, signal)[:] = np.nan
        _, _, ended, _, _ = env.step(law.command(measured, env.unwrapped.reference).T)  # type: ignore[attr-defined]
        lost |= ended
        path.append(np.array(env.unwrapped.simulation.motion[:2]))  # type: ignore[attr-defined]
    env.close()
    return np.array(path), lost


def cost(controller: str, lanes: int, calls: int = 3000) -> float:
    """Time of a call of ``command`` with the guard over that without it, the least of ten turns each."""
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=lanes, sensors="lab", policy_period=PERIOD)
    env.reset(seed=SEED)
    measured, wanted = env.unwrapped.measurement, env.unwrapped.reference  # type: ignore[attr-defined]
    guarded, bare = (make_controller(controller, Parameters()) for _ in range(2))
    assert isinstance(bare, StagedController)
    bare.stages = bare.inner_stages  # type: ignore[method-assign]
    taken: dict[str, float] = {}
    for name, law in [("guarded", guarded), ("bare", bare)] * 10:
        began = time.perf_counter()
        for _ in range(calls // 10):
            law.command(measured, wanted)
        taken[name] = min(taken.get(name, np.inf), time.perf_counter() - began)
    env.close()
    return taken["guarded"] / taken["bare"]


@dataclass(kw_only=True)
class Settings(Configured):
    """Print how far heads are from where they were with all samples, and what the guard of signals costs."""

    lanes: Annotated[int, whole(1, 65536)] = 64
    """Worlds of each outage."""
    sensors: Annotated[tuple[Sensors, ...], MANY] = ("ideal", "lab")
    controllers: Annotated[tuple[str, ...], MANY] = CONTROLLERS


@register(study="missing-samples", about="what a rig does while a sensor is silent")
def main(arguments: Settings) -> None:
    """Print the tables."""
    print(f"{'controller':24} {'sensors':8} {'signal':11}", *(f"{1e3 * lasts:>16g} ms" for lasts in OUTAGES))
    for controller in arguments.controllers:
        for sensors in arguments.sensors:
            duration = BEGINS + max(OUTAGES) + AFTER
            whole, gone = run(controller, sensors, None, 0.0, arguments.lanes, duration)
            for signal in SILENT:
                cells = []
                for lasts in OUTAGES:
                    end = round((BEGINS + lasts + AFTER) / PERIOD)
                    path, lost = run(controller, sensors, signal, lasts, arguments.lanes, BEGINS + lasts + AFTER)
                    kept = ~(gone | lost)
                    far = 1e3 * np.linalg.norm(path - whole[:end], axis=1).max(axis=0)[kept]
                    new = int((lost & ~gone).sum())
                    cells.append(f"{np.median(far):6.2f}; {np.quantile(far, 0.95):5.1f}; {new:2d}")
                print(f"{controller:24} {sensors:8} {signal:11}", *(f"{cell:>19}" for cell in cells), flush=True)
    for lanes in (1, 64):
        print(f"guard, {lanes} lanes:", {name: round(cost(name, lanes), 3) for name in arguments.controllers})
