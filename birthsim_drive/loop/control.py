"""The control loop: read, look, compute, look, write, keep; in phases from the ramp to the stated end.

    wait -> ramp -> course -> fade -> end          fault -> end, or hold -> end

In the *ramp* the target goes from where the end effector is to the course's first, and the openings grow from none to those of
the controller; in the *fade* they go back, while the target stays. The *end* is what the owner has chosen for the fault: all
valves closed or venting. After a normal course the valves close. ``hold`` keeps the controller on a target that stays.
"""

import math
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from baselines.controller import Controller
from baselines.staged import StagedController
from birthsim_drive.course import Course, Lead, hold, resting, smooth
from birthsim_drive.driver import Driver
from birthsim_drive.loop.record import PHASES, Period, Record, keep_signals
from birthsim_drive.safety.faults import CLOSE, HOLD, LASTS, Fault
from birthsim_drive.safety.limits import Limits
from birthsim_drive.safety.supervisor import Found, Supervisor
from birthsim_env.loop.guard import PNEUMATIC, STIFFNESS
from birthsim_env.loop.rows import Signals
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.idle import idle_pressures
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem

WAIT, RAMP, COURSE, HOLDS, FADE, END = range(len(PHASES))

SIGNALS, OPENING, LAW = Period.signals.place, Period.opening.place, Period.law.place
LAST = slice(Period.arrived.first, Period.missed.first + 1)
"""Where a row of a ``Record`` has what."""


def warm_up(law: Controller) -> None:
    """Load, or compile, what a controller of the package runs, before a rig is asked for samples."""
    if isinstance(law, StagedController):
        rows = Reference.lane(position=[0.5, 0.0], stiffness=STIFFNESS, pneumatic_stiffness=PNEUMATIC)
        law.command(nothing_measured(), Reference(rows[:, None]))
        law.reset(np.ones(1, dtype=np.bool_))


def nothing_measured() -> Measurement:
    """A sample, over one lane, that says nothing, which a controller's guard bridges."""
    none, pair = np.full(1, np.nan), np.full((2, 1), np.nan)
    return Measurement(none, pair, none, pair, np.full((4, 1), np.nan), pair, True, pair)


def in_a_lane(seen: Measurement, idle: Mapping[int, float]) -> Measurement:
    """A sample of one rig as one over one lane, which controllers take without a detour.

    ``idle`` has pressures, Pa, of chambers that the rig lacks: whatever its driver says of them, no law shall wait for it."""
    acceleration, pressures = None if seen.acceleration is None else seen.acceleration[:, None], seen.pressures[:, None]
    if idle:
        pressures = pressures.copy()
        for chamber, pressure in idle.items():
            pressures[chamber] = pressure
    return Measurement(
        np.reshape(seen.time, 1), seen.position[:, None], np.reshape(seen.position_time, 1), seen.velocity[:, None],
        pressures, seen.user_force[:, None], seen.sampled, acceleration,
    )  # fmt: skip


@dataclass
class Loop:
    """A controller, what it is asked for, and a rig behind a driver.

    ``course`` of None rests where the end effector is for ``duration`` s. ``ramp``, s, is that of beginning and end; 0: none.
    In a ``dry`` run the valves stay closed, whatever the controller asks for.
    """

    law: Controller
    course: Course | None
    driver: Driver
    limits: Limits
    rig: Parameters
    record: Record
    needs: tuple[str, ...]
    duration: float = 0.0
    ramp: float = 1.0
    dry: bool = False
    parent: int = 0
    """Process that watches this one, and without which it ends; 0: none."""
    lockstep: bool = False
    """Whether the rig waits for every answer, so that the first sample is not too old after all is loaded."""
    faults: list[Fault] = field(default_factory=list)
    """What went wrong, in order."""

    def __post_init__(self) -> None:
        self._supervisor = Supervisor(self.limits, self.rig, self.needs)
        self._idle = idle_pressures(self.rig)
        self._period = self.rig.electronics.control_period
        self._phase, self._count, self._since = WAIT, 0, 0.0
        self._started, self._now, self._begun = time.perf_counter(), 0.0, 0.0
        self._course: Course | None = None
        self._lead: Lead | None = None
        self._nothing = self._measured = nothing_measured()
        self._reference: Array = np.zeros((Reference.size, 1))
        self._openings, self._written, self._ending = [0.0] * 4, np.zeros(4), 0.0
        self._authority, self._action, self._holding, self._was_open = 1.0, CLOSE, "", False

    def run(self) -> None:
        """Until the course and its end are over, or a fault has led to its end; then the driver is stopped."""
        try:
            while self._count < self.record.room and self._goes_on():
                self._one_period()
        finally:
            self.driver.stop()

    def _goes_on(self) -> bool:
        return not (self._phase == END and self._ending >= self.limits.end(self._action)[1])

    def _one_period(self) -> None:
        seen, arrived = self._read()
        self.record.pulse = arrived if self._phase > WAIT else 0.0
        if self._may_be_interrupted() and (self.record.shall_end or self.parent not in (0, os.getppid())):
            self._fault(("interrupted", ""))
        if self._phase == WAIT and seen is not None and self._supervisor.has_begun:
            self._begin(seen)
        if self._phase < END:
            self._computed()
        self._write()
        self._keep(seen, arrived)

    def _may_be_interrupted(self) -> bool:
        return self._phase < HOLDS or (self._phase == HOLDS and self._holding != "interrupted")

    def _read(self) -> tuple[Measurement | None, float]:
        """The next sample, and when it arrived; None where there is none."""
        found: Found = None
        seen: Measurement | None = None
        try:
            seen = self.driver.read()
        except TimeoutError:
            found = self._supervisor.miss() if self._supervisor.has_begun else None
        except Exception as error:
            found = "read", problem(error)
        arrived = time.perf_counter()
        if self._phase == WAIT:
            waited = arrived - self._started
            if waited > self.limits.start_time and not self._supervisor.has_begun:
                found = found or ("start", f"none for {waited:.3g} s; allowed: {self.limits.start_time:g} s")
        if seen is not None:
            told = float(seen.time)
            self._now = told if math.isfinite(told) else self._now + self._period
            target = self._reference[:2, 0].tolist() if self._phase in (COURSE, HOLDS) else None
            looked = self._supervisor.look(seen, arrived, target)
            found = found or looked or self._shut()
            self._measured = in_a_lane(seen, self._idle)
        else:
            self._now += self._period if self._phase > WAIT else 0.0
            self._measured = self._nothing
        self._fault(found)
        return seen, arrived

    def _shut(self) -> Found:
        """Whether the rig has closed its valves since control began."""
        shut = getattr(self.driver, "is_shut", False)
        self._was_open = self._phase > WAIT and (self._was_open or not shut)
        return ("rig", "") if shut and self._was_open and self._phase < END and not self.dry else None

    def _computed(self) -> None:
        """Find reference, openings and authority of this period."""
        if self._course is None or self._lead is None:
            return  # the valves stay closed
        now = self._now - self._begun
        self._next_phase(now, self._course, self._lead)
        if self._phase == RAMP:
            self._reference[:, 0] = self._lead.at(now)
        elif self._phase == COURSE:
            self._reference[:, 0] = self._course.references[:, self._course.at(now - self._lead.lasts)]
        else:
            hold(self._reference[:, 0])
        try:
            found = np.asarray(self.law.command(self._measured, Reference(self._reference)), dtype=np.float64)[:, 0].tolist()
        except Exception as error:
            self._fault(("controller", problem(error)))
            return
        if self._fault(self._supervisor.command(found)):
            return
        if self._phase == COURSE:
            added = self._course.added[:, self._course.at(now - self._lead.lasts)].tolist()
            found = [max(-1.0, min(1.0, one + more)) for one, more in zip(found, added, strict=True)]
        self._openings = found

    def _begin(self, seen: Measurement) -> None:
        """With the first good sample lay out the controller for what it has; with the next one control begins."""
        position = np.array(seen.position)
        if self._course is None:
            self._course = self.course or resting(position, self.rig, self.duration)
            self._reference[:, 0] = self._course.references[:, 0]
            # A controller that is told of other sensors would forget what it knows.
            self._nothing = replace(self._nothing, sampled=seen.sampled)
            try:
                self.law.command(self._measured, Reference(self._reference))
                self.law.reset(np.ones(1, dtype=np.bool_))
            except Exception as error:
                self._fault(("controller", problem(error)))
            if not self.lockstep:
                self._supervisor = Supervisor(self.limits, self.rig, self.needs)
                return
        self._lead = Lead(self._course, position, self.ramp)
        self._begun = self._now
        self._enter(RAMP)

    def _next_phase(self, now: float, course: Course, lead: Lead) -> None:
        if self._phase == RAMP and now >= lead.lasts:
            self._enter(COURSE)
        if self._phase in (COURSE, HOLDS) and now >= lead.lasts + (len(course) - 0.5) * course.period:
            self._enter(FADE if self.ramp > 0.0 else END)
        if self._phase == FADE and self._now - self._since >= self.ramp:
            self._enter(END)
        self._authority = 1.0
        if now < lead.lasts:
            self._authority = smooth(now / lead.lasts, 0)
        if self._phase == FADE:
            self._authority *= 1.0 - smooth((self._now - self._since) / self.ramp, 0)

    def _enter(self, phase: int) -> None:
        self._phase, self._since = phase, self._now

    def _fault(self, found: Found) -> bool:
        """Act on a fault; whether there is one."""
        if found is None or self._phase == END:
            return found is not None
        kind, said = found
        action = self.limits.action(kind)
        if self.dry:
            if not any(one.kind == kind for one in self.faults):
                self.faults.append(Fault(kind, self._time(), said, f"dry run, nothing happens; else: {action}"))
            if kind in ("interrupted", "start", "read", "write"):
                self._end(CLOSE)
            return True
        if self._phase == HOLDS:
            if kind == self._holding and self._now - self._since < LASTS:
                return False
            action = CLOSE if action == HOLD else action
        if action == HOLD and self._phase == WAIT:
            action = CLOSE
        self.faults.append(Fault(kind, self._time(), said, action))
        if action == HOLD:
            self._holding = kind
            self._enter(HOLDS)
            return False
        if kind == "interrupted" and action == CLOSE and self._phase > WAIT and self.ramp > 0.0:
            self._enter(FADE)
            return False
        self._end(action)
        return True

    def _end(self, action: str) -> None:
        self._action = action
        self._enter(END)

    def _time(self) -> float:
        return self._now - self._begun if self._lead is not None else 0.0

    def _write(self) -> None:
        most = self.limits.opening
        if self.dry:
            self._written[:] = 0.0
        elif self._phase == END:
            self._written[:] = self.limits.end(self._action)[0]
        else:
            self._written[:] = [max(-most, min(most, one * self._authority)) for one in self._openings]
        try:
            self.driver.write(self._written)
        except Exception as error:
            self._fault(("write", problem(error)))
            self._ending = math.inf  # nothing can be written: the driver is stopped at once

    def _keep(self, seen: Measurement | None, arrived: float) -> None:
        row, spent = self.record.row(self._count), time.perf_counter() - arrived
        if seen is not None:
            keep_signals(row[SIGNALS], seen)
        row[SIGNALS][Signals.reference.place] = self._reference[:, 0]
        row[OPENING], row[LAW] = self._written, self._openings
        missed = getattr(self.driver, "missed", -1)
        row[LAST] = arrived, arrived + spent, 0.0 if seen is None else 1.0, self._phase, missed
        self._count += 1
        self._ending += self._period if self._phase == END else 0.0
        self.record.count = self._count
        if self._phase < END and seen is not None and not self.lockstep:
            self._fault(self._supervisor.computed(spent))
