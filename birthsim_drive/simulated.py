"""A simulated rig that is driven as a real one is: in a process of its own, by samples and commands over a socket.

It runs an episode of an environment. In every control period it sends what its sensors say and waits for the answer until the
period is over; with an answer in time the openings act as they do in a loop in Python, bit for bit. Without one the former
openings stay, and after ``WATCHDOG`` it closes its valves, as a rig's own watchdog must. With ``lockstep`` it waits for every
answer, however long that takes, and no clock runs. What became of the rig is in a ``Fate``.
"""

import math
import select
import socket
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import gymnasium
import numpy as np

from baselines.driving import driving
from birthsim_drive.packet import (
    ACCELERATION,
    CLOSED,
    COMMAND_SIZE,
    ENCODERS,
    FORCE,
    SAMPLED,
    STOPS,
    Sample,
    read_command,
)
from birthsim_drive.provoked import Provoked, provoked, said
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

WATCHDOG = 0.02
"""s without an answer after which the rig closes its valves; assumed, as in a drive's fieldbus."""

SILENCE = 1.0
"""s without an answer after which the rig takes its peer for gone, and ends."""

PATIENCE = 60.0
"""s for which either waits for the other in lockstep: a controller may be compiled first."""

AFTER = 0.3
"""s that the rig goes on with closed valves once it has been told to stop."""

REHEARSED = 3
"""Periods that are run, and forgotten, before anybody is let in: what is first loaded then takes time."""

FIRST = 60.0
"""s for which it waits to be asked for samples."""

BEHIND = 5
"""Periods that the simulation may be behind the clock before it begins anew from there; no real rig's clock stands still."""

LEFT = 0.15
"""Fraction of a period that the simulation of the next one takes; an answer has the rest of it."""


@dataclass(frozen=True)
class Simulated:
    """An episode to serve: an environment's id with the ``rig`` that it has, sensors, seed; and what goes wrong on purpose."""

    environment: str
    rig: Parameters
    sensors: str = "lab"
    seed: int = 0
    lockstep: bool = False
    provoked: tuple[str, ...] = ()


@dataclass
class Fate:
    """What became of a simulated rig, by its own truth, which no sensor blurs."""

    periods: int = 0
    """Control periods that it ran."""
    missed: int = 0
    """Samples that no command answered in time."""
    stalls: int = 0
    """Times that the simulation was late itself, and began anew from there."""
    ended: str = "its peer stopped it"
    """Why it ended."""
    impact: float = 0.0
    """m/s, the fastest collision of a piston with an end stop."""
    speed: float = 0.0
    """m/s, the fastest of the end effector."""
    pressures: tuple[float, float] = (math.inf, -math.inf)
    """Pa, lowest and highest of all chambers."""
    openings: list[float] = field(default_factory=lambda: [0.0] * 4)
    """Last openings of the valves of chambers P1, N1, P2, N2."""


class _OverError(Exception):
    """The episode of a simulated rig has ended; its only argument says why."""


class _Remote:
    """A controller that asks a peer."""

    def __init__(self, told: Simulated, rig: Parameters, link: socket.socket) -> None:
        self._told, self._link, self._peer = told, link, None  # type: Simulated, socket.socket, tuple[str, int] | None
        self._period, self._counter, self._answered = rig.electronics.control_period, 0, 0
        self._openings: Array = np.zeros(4)
        self._silent, self._stopped, self._due = 0, -1, 0.0
        self._provoked: list[Provoked] = [provoked(one) for one in told.provoked]
        counts = told.sensors.startswith("encoders") or rig.linkage.is_rail
        self._flags = FORCE | (ENCODERS if counts else 0)
        self.missed, self.stalls, self.last, self.rehearses = 0, 0, np.zeros(4), True

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Send a sample and wait for its answer."""
        if self.rehearses:
            return np.zeros((4, 1))
        if self._peer is None:
            self._wait_for_a_peer()
        if not self._told.lockstep:
            self._wait_for_the_clock()
        self._counter += 1
        self._send(measurement)
        answered = self._answered_in_time() if self._stopped < 0 else False
        self._silent = 0 if answered else self._silent + 1
        self.missed += not answered and self._stopped < 0
        if self._silent * self._period > WATCHDOG:
            self._openings = np.zeros(4)
        self._due += self._period
        if self._stopped >= 0:
            self._stopped += 1
            if self._stopped * self._period > AFTER:
                raise _OverError("its peer stopped it")
        elif self._silent * self._period > SILENCE:
            raise _OverError("its peer fell silent")
        self.last = self._openings
        return self._openings[:, None].copy()

    def reset(self, lanes: Any = None) -> None:
        """There is nothing to forget."""

    def _wait_for_the_clock(self) -> None:
        left = self._due - time.perf_counter()
        if left < -BEHIND * self._period:
            self.stalls, self._due = self.stalls + 1, time.perf_counter()
        while (left := self._due - time.perf_counter()) > 0.0:
            time.sleep(left if left > 2e-4 else 0.0)

    def _wait_for_a_peer(self) -> None:
        self._link.settimeout(FIRST)
        try:
            while True:
                content, peer = self._link.recvfrom(2 * COMMAND_SIZE)
                if (told := read_command(content)) is not None:
                    break
        except TimeoutError:
            raise _OverError("nobody asked for samples") from None
        if told.state == STOPS:
            raise _OverError("its peer stopped it")
        self._peer, self._due = peer, time.perf_counter()

    def _send(self, measurement: Measurement) -> None:
        acceleration = [0.0, 0.0] if measurement.acceleration is None else measurement.acceleration[:, 0].tolist()
        signals = (
            float(measurement.time[0]), *measurement.position[:, 0].tolist(), float(measurement.position_time[0]),
            *measurement.velocity[:, 0].tolist(), *acceleration, *measurement.pressures[:, 0].tolist(),
            *measurement.user_force[:, 0].tolist(),
        )  # fmt: skip
        flags = self._flags | (SAMPLED if measurement.sampled else 0)
        flags |= 0 if measurement.acceleration is None else ACCELERATION
        flags |= CLOSED if self._silent * self._period > WATCHDOG else 0
        sample = Sample(self._counter, signals, self._answered, self.missed, flags)
        for packet in said(sample, self._provoked):
            self._link.sendto(packet, self._peer or ("", 0))

    def _answered_in_time(self) -> bool:
        """Take answers until that to the present sample is there, or until it is too late for it."""
        until = time.perf_counter() + (1.0 - LEFT) * self._period
        while True:
            left = PATIENCE if self._told.lockstep else until - time.perf_counter()
            if not select.select([self._link], [], [], max(left, 0.0))[0]:
                if self._told.lockstep:
                    raise _OverError("its peer fell silent")
                return False
            content, peer = self._link.recvfrom(2 * COMMAND_SIZE)
            told = read_command(content)
            if told is None:
                continue
            if told.state == STOPS:  # whoever says so
                self._stopped, self._openings = 0, np.array(told.openings)
                return True
            if peer == self._peer and told.answers == self._counter and np.abs(told.openings).max() <= 1.0:
                self._answered, self._openings = told.answers, np.array(told.openings)
                return True


def serve(told: Simulated, link: socket.socket, begins: Callable[[], object] = lambda: None) -> Fate:
    """Run a simulated rig behind a bound socket until its peer stops it or falls silent; ``begins`` is called when all is
    loaded."""
    rig = told.rig
    remote, fate = _Remote(told, rig, link), Fate()
    env: Any = gymnasium.make(
        told.environment,
        parameters=rig,
        policy_period=rig.electronics.control_period,
        actuation=driving(remote, None),
        sensors=told.sensors,
    )
    env.reset(seed=told.seed)
    simulation, plant = env.unwrapped.simulation, env.unwrapped.simulation.plant
    simulation.run(REHEARSED)
    env.reset(seed=told.seed)
    simulation.impacts[:] = 0.0
    remote.rehearses = False
    begins()
    try:
        while True:
            simulation.run(1)
            fate.periods += 1
            motion, pressures = simulation.motion[:, 0].tolist(), plant.pressures[:, 0].tolist()
            fate.speed = max(fate.speed, math.hypot(*motion[2:]))
            fate.pressures = (min(fate.pressures[0], *pressures), max(fate.pressures[1], *pressures))
    except _OverError as over:
        fate.ended = str(over)
    finally:
        env.close()
        fate.impact, fate.missed, fate.stalls = float(simulation.impacts.max()), remote.missed, remote.stalls
        fate.openings = remote.last.tolist()
    return fate


def fate_of(told: dict[str, Any]) -> Fate:
    """A fate that came as JSON."""
    return Fate(**{**told, "pressures": tuple(told["pressures"])})


def as_json(fate: Fate) -> dict[str, Any]:
    """A fate as JSON."""
    return asdict(fate)
