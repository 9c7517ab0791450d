"""The stage before the residual's own: where the pistons are, and the acceleration that is not explained of them.

Its observer is given the hand's force. It never lets a piston rest: a residual is there for what friction hides.
"""

from agents.residual import unexplained
from baselines.estimation import disturbance_observer, observers
from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from baselines.staged import ControllerStage
from birthsim_env.loop.rows import POSITION, Seen
from birthsim_env.loop.signals import Joints, Point
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, rows
from birthsim_env.physics.rig.parameters import Parameters


class ObservedPistons(Rows):
    """What is handed on."""

    joints = part(Joints, "measured or estimated")
    disturbance = rows("1 2", "m/s2", "acceleration that is not explained")


class Sampled(Numbers):
    """Constants where positions are samples."""

    rows_of_memory = number("1", "rows of the observer")
    model = part(AssumedParameters, "of the observer")


@helper
def _fill_inputs(force: Array, assumed: AssumedParameters, inputs: Inputs, n: int) -> None:
    """Writes the observer's ``inputs``, with the hand's ``force`` (2, n), N."""
    for i in range(n):
        for k in range(2):
            inputs.force[k, i], inputs.believed[k, i] = force[k, i], 0.0
        inputs.moving[i], inputs.noise[i], inputs.inverse_mass[i] = 1.0, assumed.noise, assumed.rig.inverse_mass


@helper
def _hand_on(pistons: Pistons, found: ObservedPistons, n: int) -> None:
    """Writes the disturbance."""
    for i in range(n):
        for k in range(2):
            found.disturbance[k, i] = pistons.disturbance[k, i]


@kernel
def _measure(world: int, seen: Seen, pistons: Pistons, assumed: AssumedParameters, tables: int, lane: int, n: int) -> int:
    """Where positions and speeds are measured."""
    inputs, found = Inputs(scratch(Inputs.size)), ObservedPistons(seen.intermediate[: ObservedPistons.size])
    _fill_inputs(seen.user_force, assumed, inputs, n)
    point = Point(seen.rows[POSITION : POSITION + Point.size])
    disturbance_observer.observe(pistons, point, seen.pressure, inputs, assumed, found.joints, n)
    _hand_on(pistons, found, n)
    return 0


@kernel
def _observe(world: int, seen: Seen, memory: int, constants: Sampled, tables: int, lane: int, n: int) -> int:
    """Where positions are samples."""
    signals, inputs = Seen(seen.rows[:, :n]), Inputs(scratch(Inputs.size))
    pistons, found = (
        Pistons(block(memory, int(constants.rows_of_memory))[:, :n]),
        ObservedPistons(signals.intermediate[: ObservedPistons.size]),
    )
    _fill_inputs(signals.user_force, constants.model, inputs, n)
    observers.observe(pistons, signals, signals.pressure, inputs, constants.model)
    for i in range(n):
        for k in range(2):
            found.joints.position[k, i], found.joints.speed[k, i] = pistons.position[k, i], pistons.speed[k, i]
    _hand_on(pistons, found, n)
    return 0


def observed(rig: Parameters, sampled: bool) -> ControllerStage:
    """Finds joints and disturbance."""
    fresh = observers.fresh_memory(rig, sampled)
    if not sampled:
        return ControllerStage(_measure, observers.assumed_parameters(rig, unexplained.BANDWIDTH), fresh)
    assumed = observers.assumed_parameters(rig, observers.BANDWIDTH)
    return ControllerStage(_observe, Sampled.numbers(rows_of_memory=len(fresh), model=assumed), fresh)
