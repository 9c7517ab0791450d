"""How punctual ``birthsim drive`` is against a simulated rig in another process: quiet, beside busy processes, with and
without a priority; and how punctual a loop of this machine is that does nothing but wait for its periods."""

import multiprocessing
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from baselines.work.tasks import Result, Task
from birthsim_drive.loop.realtime import PRIORITY, prepare
from birthsim_drive.pace import Pace
from birthsim_drive.safety.limits import Limits
from birthsim_drive.session import Drive, perform
from birthsim_drive.simulated import Simulated
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import Cell, Head, markdown

ENVIRONMENT, CONTROLLER, SENSORS = "BirthSIM/Probe-v3", "admittance-adaptive", "lab"

FLOOR = {"quiet": 0, "beside busy processes": 1}
"""Name -> whether others are busy, of the loop without work, which has the priority."""

PERIOD = 1e-3
"""s, of the loop without work: that of a drive."""

CONDITIONS = {
    "quiet, no priority": (0, 0),
    "quiet, SCHED_FIFO": (0, PRIORITY),
    "beside busy processes, no priority": (1, 0),
    "beside busy processes, SCHED_FIFO": (1, PRIORITY),
}
"""Name -> whether others are busy, and the priority of the loop and of the simulated rig."""

UNENDING = Limits(late_periods=1e9, fault_time=10.0, leap=10.0, position_age=10.0)
"""So that a late period is counted and ends nothing."""

BUSY = "while True: sum(k * k for k in range(10_000))"


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Other processes that compute all the time."""
    running = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(processes)]
    try:
        time.sleep(1.0)
        yield
    finally:
        for one in running:
            one.kill()
            one.wait()


def measure(others: int, priority: int, seconds: float) -> Result:
    """One drive's timing."""
    rig = Parameters()
    simulated = Simulated(ENVIRONMENT, rig, SENSORS)
    limits = UNENDING.for_rig(rig)
    told = Drive("simulated", CONTROLLER, rig, limits, duration=seconds, priority=priority, simulated=simulated)
    with tempfile.TemporaryDirectory() as folder, busy(others):
        outcome = perform(told, Path(folder))
    found = outcome.timing.summary()
    kept = {name: found[name] for name in ("samples", "late", "missed_by_the_rig")}
    shares = {name: {part: found[name][part] for part in ("median", "99.9 %", "largest")} for name in PARTS}
    stalls = 0 if outcome.fate is None else outcome.fate.stalls
    return {**kept, **shares, "stalls": stalls, "granted": outcome.granted, "faults": [one.kind for one in outcome.faults]}


def waited(seconds: float) -> list[float]:
    """How late each period of a loop without any work began, s, in this process, which it makes punctual."""
    prepare(PRIORITY)
    pace, late, ticks = Pace(PERIOD), [], round(seconds / PERIOD)
    begun = time.perf_counter() - pace.wait() * PERIOD
    for _ in range(ticks):
        tick = pace.wait()
        late.append(time.perf_counter() - begun - tick * PERIOD)
    return late


def measure_waiting(others: int, seconds: float) -> Result:
    """The same, in a process of its own."""
    with busy(others), multiprocessing.get_context("spawn").Pool(1) as alone:
        late = np.asarray(alone.apply(waited, (seconds,)))
    return {
        "periods": len(late),
        "late": int(np.sum(late > PERIOD)),
        "lateness": {"99.9 %": float(np.quantile(late, 0.999)), "largest": float(late.max())},
    }


PARTS = ("periods", "jitter", "computing")
STATISTICS = ("median", "99.9 %", "largest")


def _tasks(options: Options) -> dict[Any, Task]:
    drives = {
        name: Task(
            f"drive-{k}", measure, {"others": options.others * is_busy, "priority": priority, "seconds": options.seconds}
        )
        for k, (name, (is_busy, priority)) in enumerate(CONDITIONS.items())
    }
    floors = {
        name: Task(f"floor-{k}", measure_waiting, {"others": options.others * is_busy, "seconds": options.seconds})
        for k, (name, is_busy) in enumerate(FLOOR.items())
    }
    return {**drives, **floors}


def _kept(options: Options, found: Found) -> Any:
    kept: dict[str, list[Any]] = {"drives": [], "floor": []}
    for name, result in found.items():
        kept["floor" if name in FLOOR else "drives"].append({"condition": name, **result})
    return kept


def _shown(content: Content) -> dict[str, str]:
    settings, figures, floor = content["settings"], content["figures"]["drives"], content["figures"]["floor"]
    head = ["condition", "samples", "late", "missed by the rig", "stalls of the rig"]
    lines: list[list[Cell | Head]] = [[*head, *(Head(f"{name}, us", STATISTICS) for name in PARTS)]]
    for one in figures:
        cells = [[f"{1e6 * one[name][part]:,.0f}" for part in STATISTICS] for name in PARTS]
        share = 100.0 * one["late"] / one["samples"]
        lines.append(
            [
                one["condition"],
                str(one["samples"]),
                f"{one['late']} ({share:.2g} %)",
                str(one["missed_by_the_rig"]),
                str(one["stalls"]),
                *cells,
            ]
        )
    said = (
        f"`{CONTROLLER}` behind the port limiter, `{SENSORS}` sensors, {settings['seconds']:g} s at 1 kHz, loop and simulated "
        f"rig in two processes on one machine; busy: {settings['others']} others. *Late*: openings that took longer than a "
        "control period, or samples that were skipped for newer ones. *Jitter*: by how much the time between two samples' "
        "arrivals differs from that of the rig's clock. A simulated rig that is late itself by 5 periods *stalls*. "
        f"Loop: {figures[-1]['granted']}."
    )
    alone: list[list[Cell | Head]] = [["condition", "periods", "late", Head("lateness, us", ("99.9 %", "largest"))]]
    for one in floor:
        late = [f"{1e6 * one['lateness'][part]:,.0f}" for part in ("99.9 %", "largest")]
        alone.append([one["condition"], str(one["periods"]), str(one["late"]), late])
    machine = (
        f"How late the machine itself is: a loop with SCHED_FIFO {PRIORITY} that does nothing but wait for each millisecond."
    )
    return {"drive-timing.md": f"{said}\n\n{markdown(lines)}\n\n{machine}\n\n{markdown(alone)}\n"}


STUDY = Study(
    {"seconds": 20.0, "others": 4},
    _tasks,
    _kept,
    {"periods": "s", "jitter": "s", "computing": "s", "lateness": "s"},
    _shown,
    words={"seconds": "of each drive", "others": "processes that are busy"},
    timed=True,
)
register(study="drive-timing", about="how punctual drive is, quiet and beside busy processes")(STUDY)
