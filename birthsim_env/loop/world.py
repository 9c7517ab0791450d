"""Stages of the world: the plant with its clock, and what jumps."""

from functools import cache

from birthsim_env.loop.integration import integrate
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import Point
from birthsim_env.loop.stage import Stage, scratch, table2
from birthsim_env.physics import dynamics, options
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import (
    COS_GAMMA3,
    FREE,
    INVERSE_SUPPLY,
    SIN_GAMMA3,
    SOURCE,
    STATES,
    SUPPLY,
    V1,
    V2,
    Y1,
    Y2,
    Array,
    Rig,
)
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.physics.equilibrium import balance
from birthsim_env.physics.linkage.geometry import end_effector_motion
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion
from birthsim_env.physics.options import FLOWS, FURTHER, SCRATCH, TUBES
from birthsim_env.physics.pneumatics import spools


class Clock(Numbers):
    """A control period, and how it is integrated."""

    period = number("s", "control period")
    steps = number("1", "integration steps in it")


class InnerCommands(Rows):
    """What valves that do not open as they are commanded remember."""

    inner = rows(4, "1", "inner commands")


class FurtherStates(InnerCommands):
    """What the options of ``physics.options`` remember besides."""

    further = rows(FURTHER, "SI", "further states")


@helper
def _tick(world: World, seen: Seen, period: float, n: int) -> None:
    for i in range(n):
        world.tick[i] += 1.0
        seen.time[i] = world.tick[i] * period


@helper
def _move(world: World, seen: Seen, u: Array, clock: Clock, n: int) -> None:
    """One control period under openings ``u`` (4, n)."""
    x, p, steps = world.state, world.rig, int(clock.steps)
    integrate(x, u, world.force, p, steps, clock.period / steps, world.impact, n)
    dynamics.settle(x, n)
    _tick(world, seen, clock.period, n)
    end_effector_motion(x[:, :n], p[:, :n], world.motion.rows[:, :n])


@kernel
def _plant(world: World, seen: Seen, memory: int, clock: Clock, tables: int, lane: int, n: int) -> int:
    _move(world, seen, seen.opening, clock, n)
    return 0


@kernel
def _worn_plant(world: World, seen: Seen, memory: InnerCommands, clock: Clock, tables: int, lane: int, n: int) -> int:
    """As ``_plant``, with valves that do not open as they are commanded."""
    u = scratch(4)
    spools.admit(seen.opening, world.rig, memory.inner, u, n)
    _move(world, seen, u, clock, n)
    return 0


@kernel
def _optional_plant(world: World, seen: Seen, memory: FurtherStates, clock: Clock, tables: int, lane: int, n: int) -> int:
    """As ``_worn_plant``, with the options of ``physics.options``."""
    u, own, p, x, further = scratch(4), scratch(SCRATCH), world.rig, world.state, memory.further
    spools.admit(seen.opening, p, memory.inner, u, n)
    steps = int(clock.steps)
    options.integrate(x, further, u, world.force, p, steps, clock.period / steps, world.impact, own, n)
    _tick(world, seen, clock.period, n)
    options.port_motion(x[:, :n], further[:, :n], p[:, :n], world.motion.rows[:, :n])
    dynamics.copy(further[TUBES:FLOWS], world.at_valve, n)
    return 0


def plant_stage(rigs: Array, memory: Array, period: float) -> Stage:
    """The plant over one control ``period``, s, under the openings that are commanded and the force of the hand.

    ``rigs`` (PARAMETERS, N) and ``memory`` are ``lane_parameters`` and ``memory`` of a ``Plant``.
    """
    clock = Clock.numbers(period=period, steps=dynamics.steps_in(period))
    if not options.are_off(rigs):
        return Stage(_optional_plant, clock, memory)
    return Stage(_plant, clock) if spools.are_perfect(rigs) else Stage(_worn_plant, clock, memory[: InnerCommands.size])


GOES_ON, ON_TARGET, AT_PLACE = -1.0, 0.0, 1.0
"""How a lane fares where episodes begin: its own goes on, or one begins on the target, or at a place; ``Start.how``."""


class Start(Rows):
    """With what an episode begins."""

    seed = row("1", "of the lane, the bits of a whole number")
    episode = row("1", "number of the episode, likewise")
    how = row("1", "0 to begin on the target, moving with it; 1 at a place, at rest; -1 where the lane's episode goes on")
    place = rows("x y", "m", "that place, of the end effector")


class Joints(Rows):
    """How the pistons move."""

    position = rows("y1 y2", "m", "of the pistons")
    velocity = rows("v1 v2", "m/s", "of the pistons")


class NominalRig(Numbers):
    """The rig as described, by whose geometry the pistons are put."""

    rig = part(Rig, "as described")


@kernel
def _start(world: World, seen: Seen, own: Start, constants: NominalRig, tables: int, lane: int, n: int) -> int:
    """Puts the pistons on the target, or where they are to start, the chambers in balance."""
    motion, joints, x = Point(scratch(Point.size)), Joints(scratch(Joints.size)), scratch(STATES)
    asked, p = seen.reference, world.rig[:, :n]
    for i in range(n):
        at_place = own.how[i] > 0.0
        for axis in range(2):
            motion.position[axis, i] = own.place[axis, i] if at_place else asked.position[axis, i]
            motion.velocity[axis, i] = 0.0 if at_place else asked.velocity[axis, i]
    piston_motion(motion.rows, constants.rig, joints.rows, n)
    for i in range(n):
        x[Y1, i], x[Y2, i] = p[FREE, i] * joints.position[0, i], joints.position[1, i]
        x[V1, i], x[V2, i] = p[FREE, i] * joints.velocity[0, i], joints.velocity[1, i]
    balance(x[:, :n], asked.pneumatic_stiffness, p)
    for k in range(STATES):
        for i in range(n):
            world.state[k, i] = x[k, i] if own.how[i] >= 0.0 else world.state[k, i]
    end_effector_motion(world.state[:, :n], p, world.motion.rows[:, :n])
    return 0


@helper
def _forget(inner: Array, start: Start, n: int) -> None:
    """Valves have not moved yet where an episode begins."""
    for valve in range(4):
        for i in range(n):
            inner[valve, i] = 0.0 if start.how[i] >= 0.0 else inner[valve, i]


@kernel
def _forget_valves(world: int, seen: int, memory: InnerCommands, constants: int, tables: int, lane: int, n: int) -> int:
    _forget(memory.inner, Start(table2(tables, 0)[:, lane : lane + n]), n)
    return 0


@kernel
def _rest(world: World, seen: int, memory: FurtherStates, constants: int, tables: int, lane: int, n: int) -> int:
    """As ``_forget_valves``, and what the options of ``physics.options`` begin with. Table: ``Start``."""
    start, p, further = Start(table2(tables, 0)[:, lane : lane + n]), world.rig, scratch(FURTHER)
    _forget(memory.inner, start, n)
    for i in range(n):
        supply, inverse = p[SOURCE, i], 1.0 / p[SOURCE, i]
        p[SUPPLY, i] = supply if start.how[i] >= 0.0 else p[SUPPLY, i]
        p[INVERSE_SUPPLY, i] = inverse if start.how[i] >= 0.0 else p[INVERSE_SUPPLY, i]
    options.rest(world.state[:, :n], p[:, :n], further[:, :n])
    for k in range(FURTHER):
        for i in range(n):
            memory.further[k, i] = further[k, i] if start.how[i] >= 0.0 else memory.further[k, i]
    options.port_motion(world.state[:, :n], memory.further[:, :n], p[:, :n], world.motion.rows[:, :n])
    dynamics.copy(memory.further[TUBES:FLOWS], world.at_valve, n)
    return 0


def start_stages(start: Array, nominal: Array, plant: Stage) -> list[Stage]:
    """The start of an episode, wherever one begins: what puts the ``plant`` there, once target and setpoints are known.

    ``start`` (``Start.size``, N) is ``Start``, ``nominal`` (PARAMETERS,) the rig as described, ``plant`` what ``plant_stage``
    made.
    """
    first = Stage(_start, NominalRig.numbers(rig=nominal), start)
    if plant.memory is None:
        return [first]
    return [first, Stage(_rest if plant.function is _optional_plant else _forget_valves, memory=plant.memory, tables=(start,))]


class PreviousSetpoints(Rows):
    """Force and setpoints a period ago."""

    force = rows("force_x force_y", "N", "of the hand")
    stiffness = rows("Kclx Kcly", "N/m", "setpoint of closed-loop stiffness")
    stiffness_coupling = row("N/m", "what couples x and y")


class JumpDetection(Numbers):
    """What counts as a jump."""

    period = number("s", "control period")
    change = number("N", "change of a force in one period that is a jump")
    begins = number("1", "1 to start counting the present instant")


@kernel
def _jumps(
    world: World, seen: Seen, before: PreviousSetpoints, constants: JumpDetection, tables: int, lane: int, n: int
) -> int:
    force, asked = world.force, seen.reference
    for i in range(n):
        jumped = False
        for axis in range(2):
            jumped = jumped or abs(force[axis, i] - before.force[axis, i]) > constants.change
            jumped = jumped or asked.stiffness[axis, i] != before.stiffness[axis, i]
        jumped = jumped or asked.stiffness_coupling[i] != before.stiffness_coupling[i]
        since = 0.0 if jumped else world.since_jump[i] + constants.period
        world.since_jump[i] = world.since_jump[i] if constants.begins > 0.0 else since
        for axis in range(2):
            before.force[axis, i], before.stiffness[axis, i] = force[axis, i], asked.stiffness[axis, i]
        before.stiffness_coupling[i] = asked.stiffness_coupling[i]
    return 0


@cache
def _jump_detection(period: float, jump_rate: float, begins: bool) -> Array:
    """Its constants, which are the same in every episode."""
    return JumpDetection.numbers(period=period, change=jump_rate * period, begins=begins)


def jump_stage(period: float, jump_rate: float, memory: Array, begins: bool) -> Stage:
    """Counts the time since the force changed faster than ``jump_rate``, N/s, or a closed-loop setpoint changed at all.

    ``memory`` (5, N) is ``PreviousSetpoints``; where an episode ``begins`` it is only written.
    """
    return Stage(_jumps, _jump_detection(period, jump_rate, begins), memory)


@kernel
def _guide(world: World, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Leaves of the hand's force what acts along the rail, whose guide bears the rest."""
    for i in range(n):
        cosine, sine = world.rig[SIN_GAMMA3, i], -world.rig[COS_GAMMA3, i]  # of the inclination
        along = cosine * world.force[0, i] + sine * world.force[1, i]
        world.force[0, i], world.force[1, i] = along * cosine, along * sine
    return 0


def guide_stage() -> Stage:
    """What a rail bears of the hand's force, so that no one further on has to know of it."""
    return Stage(_guide)


@kernel
def _hide_force(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    for axis in range(2):
        for i in range(n):
            seen.user_force[axis, i] = 0.0
    return 0


def no_force_stage() -> Stage:
    """A rig without a force sensor: what is measured of the hand's force is zero."""
    return Stage(_hide_force)
