"""A drive from the outside: the process of the control loop, and of a simulated rig, who watches them, and what is left.

The control loop has a process of its own, so that nothing else delays it. This process watches it, shows how far it is, ends it
when it is asked to, and, where the loop hangs or is killed, stops the rig by a driver of its own. The periods stand in a file
that both share, so that no end of either loses them.
"""

import json
import multiprocessing
import os
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np

from baselines.controller import Controller
from baselines.identification.log.rail_log import on_rail
from baselines.identification.log.trial import Trial
from baselines.named import LIMITED, make_controller
from baselines.staged import StagedController
from birthsim_drive.course import Course, of_plan, of_scenario
from birthsim_drive.driver import Driver, make_driver
from birthsim_drive.drivers.udp import UdpDriver
from birthsim_drive.loop.control import END, WAIT, Loop, warm_up
from birthsim_drive.loop.realtime import prepare
from birthsim_drive.loop.record import Period, Record
from birthsim_drive.loop.timing import Timing, timing_of
from birthsim_drive.safety.faults import VENT, Fault
from birthsim_drive.safety.limits import Limits
from birthsim_drive.simulated import PATIENCE, Fate, Simulated, as_json, fate_of, serve
from birthsim_env.files import write_text
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem

HUNG = 1.0
"""s without a pulse after which the loop is taken for hung. The rig's own watchdog has closed the valves long before."""

LOADS = 120.0
"""s that the loop's process may take to load and to make its controller, on a busy machine."""

ENDS = 10.0
"""s that a process may take to end once it is asked to."""

MORE = 5.0
"""s of room for periods besides those of the course: waiting for a first sample, and the end."""

LOOK = 0.05
"""s between two looks at the loop."""

_APART = multiprocessing.get_context("spawn")
"""Processes that share nothing with this one."""

PERIODS, TOLD, FATE = "periods.at", "told.json", "fate.json"
"""Files that the processes share; the first one says where the periods are."""

MEMORY = "/dev/shm"
"""A folder whose files are in memory, and outlive processes."""


@dataclass(frozen=True)
class Drive:
    """What to do: by ``controller``, on what is behind ``driver``, after a ``plan``, or the scenario of ``environment``, or at
    rest; ``rig`` is what the controller believes. Settings of ``birthsim drive`` have the same names."""

    driver: str
    controller: str
    rig: Parameters
    limits: Limits
    plan: Path | None = None
    environment: str | None = None
    seed: int = 0
    duration: float | None = None
    ramp: float = 1.0
    limiter: bool = True
    dry: bool = False
    priority: int = 0
    simulated: Simulated | None = None


@dataclass
class Outcome:
    """What a drive has left: its periods ``kept`` (Period.size, T), ``faults``, what the system ``granted``, how the log's
    positions were measured, and the ``fate`` of a simulated rig."""

    kept: Array
    faults: list[Fault]
    granted: str
    has_encoders: bool
    period: float
    fate: Fate | None = None
    interrupted: BaseException | None = None

    @property
    def sampled(self) -> Array:
        """The periods (Period.size, S) in which a sample came."""
        return self.kept[:, self.kept[Period.has_sample.first] > 0.0]

    @property
    def timing(self) -> Timing:
        """How punctual it was."""
        rows = self.sampled
        phase = rows[Period.phase.first]
        rows = rows[:, (phase > WAIT) & (phase < END)]
        counted = rows[Period.missed.first]
        missed = int(counted[-1] - counted[0]) if rows.size and counted[0] >= 0 else -1
        times, arrived, written = (rows[one.first] for one in (Signals.time, Period.arrived, Period.written))
        return timing_of(times, arrived, written, self.period, missed)

    def trial(self, rig: Parameters) -> Trial:
        """What ``birthsim identify`` reads: a row a sample."""
        rows, signals = self.sampled, Signals(self.sampled[Period.signals.place])
        counted = np.full(2, rig.electronics.encoder_offset) if self.has_encoders else None
        force = signals.user_force if np.isfinite(signals.user_force).any() else np.zeros_like(signals.user_force)
        trial = Trial(signals.time, rows[Period.opening.place], signals.pressure, signals.position, force, counted=counted)
        return on_rail(trial, rig) if rig.linkage.is_rail else trial


def limited_name(drive: Drive) -> str:
    """The controller's name, with the port limiter before it unless the owner wants none."""
    plain = drive.controller.removeprefix(LIMITED)
    return LIMITED + plain if drive.limiter or drive.controller.startswith(LIMITED) else plain


def law_of(drive: Drive) -> Controller:
    """The controller of a drive, whose guard ends as the owner wants it at a missing sample."""
    law = make_controller(limited_name(drive), drive.rig)
    if isinstance(law, StagedController):
        law.protect("vent" if drive.limits.action("missing") == VENT else "hold", drive.limits.fault_time)
    return law


def course_of(drive: Drive) -> Course | None:
    """What is asked for; None to rest where the rig is."""
    if drive.plan is not None:
        return of_plan(drive.plan, drive.rig)
    if drive.environment is not None:
        return of_scenario(drive.environment, drive.rig, drive.seed, drive.duration)
    return None


def needs_of(law: Controller) -> tuple[str, ...]:
    """Fields of a ``Measurement`` that a controller cannot do without."""
    always = ("time", "position", "position_time", "velocity", "pressures")
    return (*always, "user_force") if getattr(law, "reads_force", True) else always


def perform(drive: Drive, place: Path, tick: Callable[[float], object] = lambda _: None) -> Outcome:
    """Drive; ``place`` is a folder for what the processes share, ``tick`` is called with the s of control so far.

    Raises ``ValueError`` for what cannot be driven, before anything moves. Where somebody interrupts, the drive ends as its
    owner has chosen, and ``Outcome.interrupted`` is to be raised once the outcome is kept.
    """
    law_of(drive)  # what is refused is refused here
    course = course_of(drive)
    lasts = (drive.duration or 0.0) if course is None else len(course) * course.period
    period = drive.rig.electronics.control_period
    for left in (TOLD, FATE):
        (place / left).unlink(missing_ok=True)
    memory = _memory(place)
    write_text(place / PERIODS, str(memory))
    record = Record.make(memory, round((lasts + 3.0 * drive.ramp + MORE) / period))
    with _rig_of(drive, place) as (driver, ready):
        process = _started(_control, drive, driver, str(place), ready)
        faults, interrupted = _watch(process, record, drive, driver, tick)
    kept = record.kept
    forget(place)
    said, fate = _told(place / TOLD) or {}, _told(place / FATE)
    if "refused" in said:
        raise ValueError(said["refused"])
    return Outcome(
        kept,
        [*(Fault(**one) for one in said.get("faults", [])), *faults],
        said.get("granted", "unknown"),
        bool(said.get("has_encoders", drive.rig.linkage.is_rail)),
        period,
        None if fate is None else fate_of(fate),
        interrupted,
    )


def _told(path: Path) -> Any:
    """What a process has left in a file, which is removed; None where there is none."""
    if not path.is_file():
        return None
    content = json.loads(path.read_text())
    path.unlink()
    return content


def recovered(place: Path, rig: Parameters) -> Outcome | None:
    """What a drive has left in ``place`` whose watching process was killed; None where there is nothing."""
    path = _memory_of(place)
    if path is None or not path.is_file():
        return None
    return Outcome(Record(path).kept, [], "unknown", rig.linkage.is_rail, rig.electronics.control_period)


def forget(place: Path) -> None:
    """Remove the periods of a drive that was kept, or recovered."""
    path = _memory_of(place)
    if path is not None:
        path.unlink(missing_ok=True)
    (place / PERIODS).unlink(missing_ok=True)


def _memory(place: Path) -> Path:
    """A new file for the periods: in memory where the system has a folder there, since a disk may hold a write up."""
    handle, path = tempfile.mkstemp(prefix="birthsim-drive-", dir=MEMORY if os.path.isdir(MEMORY) else place)
    os.close(handle)
    return Path(path)


def _memory_of(place: Path) -> Path | None:
    """That of a drive in ``place``."""
    return Path((place / PERIODS).read_text()) if (place / PERIODS).is_file() else None


@contextmanager
def _rig_of(drive: Drive, place: Path) -> Iterator[tuple[str, Event]]:
    """The driver's name, and what says that the rig is ready; a simulated one has a process, which has ended at the end."""
    ready: Event = _APART.Event()
    if drive.simulated is None:
        ready.set()
        yield drive.driver, ready
        return
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        process = _started(_simulate, drive.simulated, link, str(place), drive.priority, ready)
        try:
            yield f"udp:127.0.0.1:{link.getsockname()[1]}", ready
        finally:
            process.join(ENDS)
            _kill(process)


def _started(target: Callable[..., None], *arguments: Any) -> BaseProcess:
    """A process of its own, which shares nothing with this one."""
    if multiprocessing.get_start_method() not in multiprocessing.get_all_start_methods():
        # A worker of joblib names a way of its own, which its children do not know.
        multiprocessing.set_start_method("spawn", force=True)
    process = _APART.Process(target=target, args=arguments, daemon=True)
    process.start()
    return process


def _watch(
    process: BaseProcess, record: Record, drive: Drive, driver: str, tick: Callable[[float], object]
) -> tuple[list[Fault], BaseException | None]:
    """Wait until the loop has ended; what only this process can see, and an interruption."""
    interrupted: BaseException | None = None
    begun, said = time.perf_counter(), ""
    hung = PATIENCE if drive.simulated is not None and drive.simulated.lockstep else HUNG
    while process.is_alive() and not said:
        try:
            process.join(LOOK)
            tick(record.count * drive.rig.electronics.control_period)
            now, pulse = time.perf_counter(), record.pulse
            if now - (pulse or begun) > (hung if pulse else LOADS):
                said = "hung"
        except KeyboardInterrupt as error:
            if interrupted is not None:  # the second one
                said = "hung"
            interrupted = error
            record.ask_to_end()
    _kill(process)
    if not said and process.exitcode == 0:
        return [], interrupted
    seconds = record.count * drive.rig.electronics.control_period
    return [Fault(said or "killed", seconds, "", _stop_anew(driver, drive.rig))], interrupted


def _kill(process: BaseProcess) -> None:
    if process.is_alive():
        process.kill()
    process.join()


def _stop_anew(name: str, rig: Parameters) -> str:
    """Stop the rig by another driver, since that of the loop is gone; says whether that worked."""
    try:
        driver: Driver = make_driver(name, rig)
        driver.stop()
    except Exception as error:
        return f"the driver could NOT be stopped ({problem(error)}): press the emergency stop"
    return "the driver was stopped"


def _control(drive: Drive, driver: str, place: str, ready: Event) -> None:
    """The process of the control loop."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the watching process says when to end
    folder, parent = Path(place), os.getppid()
    try:
        law, course, record = law_of(drive), course_of(drive), Record(Path((folder / PERIODS).read_text()))
        rest = 0.0 if drive.duration is None else drive.duration
        warm_up(law)
        ready.wait(LOADS)
        made = make_driver(driver, drive.rig)
        lockstep = drive.simulated is not None and drive.simulated.lockstep
        if lockstep and isinstance(made, UdpDriver):
            made.wait = PATIENCE
    except ValueError as error:
        write_text(folder / TOLD, json.dumps({"refused": str(error)}))
        return
    loop = Loop(
        law, course, made, drive.limits, drive.rig, record, needs_of(law), rest, drive.ramp, drive.dry, parent, lockstep
    )
    granted = prepare(drive.priority)
    try:
        loop.run()
    finally:
        told = {
            "faults": [vars(one) for one in loop.faults],
            "granted": granted.words(),
            "has_encoders": bool(getattr(made, "has_encoders", drive.rig.linkage.is_rail)),
        }
        write_text(folder / TOLD, json.dumps(told))


def _simulate(simulated: Simulated, link: socket.socket, place: str, priority: int, ready: Event) -> None:
    """The process of a simulated rig."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def begins() -> None:
        prepare(priority)
        ready.set()

    with link:
        fate = serve(simulated, link, begins)
    write_text(Path(place) / FATE, json.dumps(as_json(fate)))
