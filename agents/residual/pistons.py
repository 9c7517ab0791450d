"""The stage before the residual's own: where the pistons are, and the acceleration that is not explained of them.

Its observer is given the hand's force. It never lets a piston rest: a residual is there for what friction hides.
"""

from agents.residual import unexplained
from baselines.estimation import disturbance_observer, observers
from baselines.estimation.rows import Belief, Given, Pistons
from baselines.staged import LawStage
from birthsim_env.loop.rows import POSITION, Seen
from birthsim_env.loop.signals import Joints, Point
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, rows
from birthsim_env.physics.rig.parameters import Parameters


class Found(Rows):
    """What is handed on."""

    joints = part(Joints, "measured or estimated")
    disturbance = rows("1 2", "m/s2", "acceleration that is not explained")


class Sampled(Numbers):
    """Constants where positions are samples."""

    rows_of_memory = number("1", "rows of the observer")
    belief = part(Belief, "of the observer")


@helper
def _given(force: Array, about: Belief, given: Given, n: int) -> None:
    """Writes what the observer is ``given``, with the hand's ``force`` (2, n), N."""
    for i in range(n):
        for k in range(2):
            given.force[k, i], given.believed[k, i] = force[k, i], 0.0
        given.moving[i], given.noise[i], given.inverse_mass[i] = 1.0, about.noise, about.rig.inverse_mass


@helper
def _hand_on(pistons: Pistons, found: Found, n: int) -> None:
    """Writes the disturbance."""
    for i in range(n):
        for k in range(2):
            found.disturbance[k, i] = pistons.disturbance[k, i]


@kernel
def _measure(world: int, seen: Seen, pistons: Pistons, about: Belief, tables: int, lane: int, n: int) -> int:
    """Where positions and speeds are measured."""
    given, found = Given(scratch(Given.size)), Found(seen.handed[: Found.size])
    _given(seen.user_force, about, given, n)
    point = Point(seen.rows[POSITION : POSITION + Point.size])
    disturbance_observer.observe(pistons, point, seen.pressure, given, about, found.joints, n)
    _hand_on(pistons, found, n)
    return 0


@kernel
def _observe(world: int, seen: Seen, memory: int, about: Sampled, tables: int, lane: int, n: int) -> int:
    """Where positions are samples."""
    signals, given = Seen(seen.rows[:, :n]), Given(scratch(Given.size))
    pistons, found = Pistons(block(memory, int(about.rows_of_memory))[:, :n]), Found(signals.handed[: Found.size])
    _given(signals.user_force, about.belief, given, n)
    observers.observe(pistons, signals, signals.pressure, given, about.belief)
    for i in range(n):
        for k in range(2):
            found.joints.position[k, i], found.joints.speed[k, i] = pistons.position[k, i], pistons.speed[k, i]
    _hand_on(pistons, found, n)
    return 0


def observed(rig: Parameters, sampled: bool) -> LawStage:
    """Finds joints and disturbance."""
    fresh = observers.fresh_memory(rig, sampled)
    if not sampled:
        return LawStage(_measure, observers.belief(rig, unexplained.BANDWIDTH), fresh)
    belief = observers.belief(rig, observers.BANDWIDTH)
    return LawStage(_observe, Sampled.numbers(rows_of_memory=len(fresh), belief=belief), fresh)
