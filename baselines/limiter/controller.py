"""``PortLimiter``: any law, with an energy tank that bounds what it may give to the hand, and with a limit of its speed.

*Energy.* The tank holds what the hand has given and has not been given back, at most ``MARGIN`` times the energy e'Ke/2 of the
spring that is asked for and ``capacity`` besides. Its level over ``capacity``, at most 1, bounds the law's authority: the
openings are that fraction of the law's, and for the rest those of a passive air spring about the target (``air_spring``). The
work is counted with late positions and with late forces (``port_energy``), and the emptier tank holds: so an oscillation that
goes on empties one of them. Authority comes back within ``BACK``. Where it has been low for longer than ``LASTING`` it stays
lower, for ``RECOVERY``: a law that is too stiff for a hand settles at an authority with which it gives nothing.

A target that moves does work on the hand that nobody should bound. So the work is that about the moving target; and a rig that
only stays behind its target gives nothing. A tracker's field is distorted along the way: of the hand's force times the target's
path ``ALLOWANCE`` is forgiven.

*Speed.* Beyond ``speed``, relative to the target, the valves brake: each piston's chambers are driven against its motion, fully
from ``FULL`` times that speed on. A rig whose force was balanced by a hand that lets go is faster all the same: what its
chambers hold accelerates it until the valves have let it out, with any law. What the brake shortens is how far it flies.

The tank needs a force sensor. Energy tanks: Ferraguti, Secchi and Fantuzzi, ICRA 2013; the observer: Hannaford and Ryu,
IEEE Transactions on Robotics and Automation 18(1), 2002. Numbers without a source are assumed.
"""

import math
from typing import Any, ClassVar

import numpy as np

from baselines.controller import Controller, Remarking, checked_command
from baselines.impedance import Impedance, declared_by
from baselines.inputs import lanes_of, one_lane
from baselines.limiter import air_spring
from baselines.limiter.past import recall, slots_of
from baselines.limiter.port_energy import Energy, Work, count_work
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import InPlane, Joints, Mask, Measurement, PerChamber, Point, Reference
from birthsim_env.loop.stage import Part, Stage, block, scratch
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.physics.dynamics import load
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import checked_number
from birthsim_env.restored import ANY, Declared

MARGIN = 1.5
"""A law that renders half as much again as was asked for is not to be taken for one that makes energy."""

ALLOWANCE = 0.1
"""m of error that a tracker may gather per m of the target's path."""

BACK, LASTING, RECOVERY = 0.05, 0.2, 2.0
"""s, time constants: authority comes back; a low authority lowers what it comes back to; that comes back."""

FULL = 2.0
"""The brake is on in full at so many times the speed limit."""


class PastSignals(Rows):
    """What is kept for late positions."""

    pressure = rows(4, "Pa", "of the chambers")
    force = part(InPlane, "of the hand")


class Limits(Numbers):
    """Constants of the stage."""

    capacity = number("J", "what the law may give beyond what a spring would; infinite: no tank")
    speed = number("m/s", "of the end effector relative to its target")
    period = number("s", "control period")
    slots = number("1", "control periods that are kept")
    lasting = number("1", "fraction of a low authority that lowers its ceiling in a period")
    recovery = number("1", "fraction of the ceiling that comes back")
    back = number("1", "fraction of the authority that comes back")
    balance = number("1", "fraction of the air spring's balance that is renewed")
    rig = part(Rig, "the rig as described")


class Tank(Rows):
    """What the stage remembers."""

    authority = row("1", "fraction of the law's openings that is left")
    ceiling = row("1", "what it comes back to")
    level = rows(2, "J", "of both tanks")
    stiffness = rows("Kclx Kcly Kclxy", "N/m", "setpoint a period ago; NaN before the first")
    energy = part(Energy, "between two positions")
    forces = rows(4, "N", "of chambers that balance the weight, averaged; NaN before the first")
    newest = row("1", "the last of the periods that are kept")
    past = rows(0, "SI", "pressures and the hand's force of the last periods; NaN before the first")


@helper
def _spring_energy(kx: float, ky: float, kxy: float, x: float, y: float) -> float:
    """J, of a spring [[kx, kxy], [kxy, ky]], N/m, at (x, y), m."""
    return 0.5 * (kx * x * x + ky * y * y) + kxy * x * y


@helper
def _fill(tank: Tank, work: Work, asked: Reference, constants: Limits, i: int) -> None:
    """Carries tanks and authority of lane ``i`` on by one period, in which the hand did ``work``."""
    last, (x, y) = tank.stiffness, (tank.energy.offset[0, i], tank.energy.offset[1, i])
    kx, ky, kxy = asked.stiffness[0, i], asked.stiffness[1, i], asked.stiffness_coupling[i]
    if math.isnan(last[0, i]):
        last[0, i], last[1, i], last[2, i] = kx, ky, kxy
    stored, before = _spring_energy(kx, ky, kxy, x, y), _spring_energy(last[0, i], last[1, i], last[2, i], x, y)
    last[0, i], last[1, i], last[2, i] = kx, ky, kxy
    least = math.inf
    for count in range(2):
        # A rig that only stays behind its target gives nothing.
        done = work.done[count, i]
        done = max(done, min(done + work.asked[count, i], 0.0)) + ALLOWANCE * work.path[count, i]
        # Whoever asks for a stiffer spring while it is stretched pays for it.
        level = min(tank.level[count, i] + done + max(stored - before, 0.0), MARGIN * stored + constants.capacity)
        least, tank.level[count, i] = min(least, level), max(level, 0.0)
    authority = tank.authority[i]
    tank.ceiling[i] += constants.lasting * (authority - tank.ceiling[i]) + constants.recovery * (1.0 - tank.ceiling[i])
    returned = authority + constants.back * max(tank.ceiling[i] - authority, 0.0)
    tank.authority[i] = min(min(max(least / constants.capacity, 0.0), 1.0), returned)


@helper
def _brake(seen: Seen, speed: float, moving: Joints, i: int) -> None:
    """Drives the valves of lane ``i`` against its pistons, which move relative to the target."""
    x, y = seen.velocity[0, i] - seen.reference.velocity[0, i], seen.velocity[1, i] - seen.reference.velocity[1, i]
    brake = min(max((math.sqrt(x * x + y * y) / speed - 1.0) / (FULL - 1.0), 0.0), 1.0)
    for chamber in range(4 if brake > 0.0 else 0):
        rate = moving.speed[chamber // 2, i]
        outwards = 1.0 if rate > 0.0 else -1.0 if rate < 0.0 else 0.0
        against = outwards if chamber % 2 else -outwards
        seen.opening[chamber, i] = (1.0 - brake) * seen.opening[chamber, i] + brake * against


@helper
def _joints(seen: Seen, constants: Limits, still: bool, asked: bool, joints: Joints, n: int) -> None:
    """Writes the pistons where the end effector is, or is ``asked`` to be; ``still``, or relative to the target."""
    motion, target = Point(scratch(Point.size)), seen.reference
    for k in range(2):
        for i in range(n):
            motion.position[k, i] = target.position[k, i] if asked else seen.position[k, i]
            motion.velocity[k, i] = 0.0 if still else seen.velocity[k, i] - target.velocity[k, i]
    piston_motion(motion.rows, constants.rig, joints.rows, n)


@kernel
def limit(world: int, seen: Seen, memory: int, constants: Limits, tables: int, lane: int, n: int) -> int:
    """Bounds the openings of the law before."""
    slots = int(constants.slots)
    tank, work = Tank(block(memory, Tank.size + PastSignals.size * slots)), Work(scratch(Work.size))
    now, then, passive = (
        PastSignals(scratch(PastSignals.size)),
        PastSignals(scratch(PastSignals.size)),
        PerChamber(scratch(PerChamber.size)),
    )
    here, there = Joints(scratch(Joints.size)), Joints(scratch(Joints.size))
    if constants.capacity < math.inf:
        _joints(seen, constants, True, False, here, n)
        _joints(seen, constants, True, True, there, n)
        load(seen.pressure, 0, n, now.pressure)
        load(seen.user_force, 0, n, now.force.rows)
        for i in range(n):
            late = (seen.time[i] - seen.position_time[i]) / constants.period
            recall(tank.past, tank.newest, slots, late, now.rows, then.rows, i)
            count_work(tank.energy, seen, then.force.rows, work, i)
            _fill(tank, work, seen.reference, constants, i)
            air_spring.passive_openings(
                tank.forces, constants.balance, then.pressure, then.force, here, there, seen, constants.rig, passive.rows, i
            )
            for valve in range(4):
                own = tank.authority[i]
                seen.opening[valve, i] = own * seen.opening[valve, i] + (1.0 - own) * passive.rows[valve, i]
    _joints(seen, constants, False, False, here, n)
    for i in range(n):
        _brake(seen, constants.speed, here, i)
    return 0


class PortLimiter(StagedController):
    """A law of N lanes with an energy tank and a speed limit at the port: a stage behind those of the law, if it is compiled.

    Arguments: the ``law``; the rig ``parameters`` as it believes them; ``capacity``, J, what it may give to a hand beyond what
    a spring would; ``speed``, m/s, of the end effector relative to its target. Infinity switches a limit off. Raises
    ``ValueError`` for numbers that are not positive.
    """

    in_state: ClassVar[Declared] = {"_memories": ANY}
    """NaN stands for what there is no past of."""

    def __init__(self, law: Controller, parameters: Parameters, capacity: float = 0.015, speed: float = 0.5) -> None:
        for name, value, unit in (("capacity", capacity, "J"), ("speed", speed, "m/s")):
            if value != math.inf:
                checked_number(name, value, unit, above=0.0)
        super().__init__(parameters)
        self.law, self._capacity, self._speed = law, capacity, speed
        self._options: dict[str, Any] = {}
        self.reads_force = capacity < math.inf or getattr(law, "reads_force", True)
        self._stages = law if isinstance(law, StagedController) and law.is_compiled() else None

    @property
    def COMMAND_OPTIONS(self) -> tuple[str, ...]:  # type: ignore[override]
        """What the law's ``command`` takes besides the signals, and this one hands on."""
        return getattr(self.law, "COMMAND_OPTIONS", ())

    @property
    def asks(self) -> bool:  # type: ignore[override]
        return self._stages is not None and self._stages.asks

    @property
    def authority(self) -> Array:
        """The fraction of its openings that a law has now, (N,)."""
        return Tank(self._memories[0]).authority

    def is_compiled(self) -> bool:
        """Whether the law is."""
        return self._stages is not None

    def declared_impedance(self, reference: Reference) -> Impedance | None:
        """That of the law, which holds where neither limit acts."""
        return declared_by(self.law, reference)

    def remarks(self) -> list[str]:
        """What the law has to say of the control so far."""
        return self.law.remarks() if isinstance(self.law, Remarking) else []

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        period = self.parameters.electronics.control_period
        lasting, recovery, back, balance = (
            1.0 - exact.number("exp", -period / lag) for lag in (LASTING, RECOVERY, BACK, air_spring.MEMORY)
        )
        constants = Limits.numbers(
            capacity=self._capacity,
            speed=self._speed,
            period=period,
            slots=slots_of(period),
            lasting=lasting,
            recovery=recovery,
            back=back,
            balance=balance,
            rig=self._p,
        )
        fresh = Tank.lane(
            authority=1.0,
            ceiling=1.0,
            level=self._capacity,
            stiffness=np.nan,
            energy=Energy.lane(stamp=-np.inf),
            forces=np.nan,
            past=np.full(PastSignals.size * slots_of(period), np.nan),
        )
        return [ControllerStage(limit, constants, fresh)]

    def prepare(self, lanes: int, sampled: bool) -> None:
        if self._stages is not None:
            self._stages.prepare(lanes, sampled)
        super().prepare(lanes, sampled)

    def policy_stages(self) -> list[Part]:
        return [] if self._stages is None else self._stages.policy_stages()

    def inner_stages(self) -> list[Part]:
        """The law's, and the limits."""
        own = Stage(self._made[0].function, self._made[0].constants, self._memories[0], sees_world=False)
        return [*([self._call] if self._stages is None else self._stages.inner_stages()), own]

    def _call(self, period: int) -> None:
        """The law, where it is not compiled."""
        measurement, reference = self.good_signals()
        openings = self.law.command(measurement, reference, **self._options)
        self._openings[:] = checked_command(type(self.law).__name__, openings, lanes_of(measurement, reference))

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        return [] if self._stages is None else self._stages.more_rows(lanes)

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        if self._stages is not None:
            self._stages.explain(measurement, reference)

    def require_acceleration(self, measurement: Measurement) -> None:
        if self._stages is not None:
            self._stages.require_acceleration(measurement)

    def _reads_acceleration(self) -> bool:
        return self._stages is not None and self._stages._reads_acceleration()

    def reset(self, lanes: Mask | None = None) -> None:
        self.law.reset(lanes)
        super().reset(lanes)

    def command(self, measurement: Measurement, reference: Reference, *feedforward: Any, **options: Any) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        ``options`` are those of the law, see ``COMMAND_OPTIONS``. Raises what the law raises; ``ValueError`` for openings
        that are none.
        """
        if self._stages is not None:
            return super().command(measurement, reference, *feedforward, **options)
        if len(shape_of(measurement.position)) == 1:
            options = {name: np.asarray(given)[..., None] for name, given in options.items()}
            return self.command(*one_lane(measurement, reference), **options)[:, 0]
        self._options = options
        if self.run_stages(measurement, reference):
            self.refuse(measurement, reference)
        return self._openings.copy()
