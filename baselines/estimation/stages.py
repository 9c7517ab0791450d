"""Stages that laws share: the motion that the hand should find, and where the pistons are."""

import numpy as np

from baselines.estimation.admittance import DAMPING_RATIO, Compliance, mark_moving, update_motion
from baselines.estimation.observers import assumed_parameters, fresh_memory, observe
from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from baselines.staged import ControllerStage
from birthsim_env.loop.rows import INTERMEDIATE, POSITION, Seen
from birthsim_env.loop.signals import Joints, Motion, Point
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.parameters import Parameters


class PistonEstimate(Rows):
    """What these stages hand on. A law's own rows follow."""

    motion = part(Motion, "motion that the hand should find")
    moving = row("1", "1 where that motion is faster than ``MOVING_SPEED``, else 0")
    joints = part(Joints, "measured or estimated")


MOTION, MOVING, JOINTS, OWN = (
    INTERMEDIATE + first
    for first in (PistonEstimate.motion.first, PistonEstimate.moving.first, PistonEstimate.joints.first, PistonEstimate.size)
)


@kernel
def _comply(world: int, seen: Seen, offset: Point, constants: Compliance, tables: int, lane: int, n: int) -> int:
    """Writes motion and ``moving``; returns how many stiffness setpoints are not positive definite."""
    s = Seen(seen.rows[:, :n])
    estimate = PistonEstimate(s.intermediate[: PistonEstimate.size])
    own, heavier = Point(offset.rows[:, :n]), scratch(1)[0, :n]
    for i in range(n):
        heavier[i] = 1.0
    missed = update_motion(own, s.asked, s.user_force, constants, s.damping_factor, heavier, estimate.motion)
    mark_moving(estimate.motion, estimate.moving)
    return missed


def compliance(rig: Parameters) -> Array:
    """``Compliance`` with the mass of the rig."""
    return Compliance.numbers(mass=rig.mechanics.mass, damping_ratio=DAMPING_RATIO, period=rig.electronics.control_period)


def compliant_motion(rig: Parameters) -> ControllerStage:
    """Turns the measured force into the motion that the hand should find."""
    return ControllerStage(_comply, compliance(rig), Point.lane())


@kernel
def _measure(world: int, seen: Seen, memory: int, rig: Rig, tables: int, lane: int, n: int) -> int:
    """Writes the joints that are measured."""
    joints = PistonEstimate(seen.intermediate[: PistonEstimate.size]).joints
    piston_motion(seen.rows[POSITION : POSITION + Point.size], rig, joints.rows, n)
    return 0


class Location(Numbers):
    """Constants of the stage that observes the pistons."""

    rows_of_memory = number("1", "rows of the observer")
    informed = number("1", "1 where the observer knows the force of the hand and whether the motion moves")
    model = part(AssumedParameters, "of the observer")


@kernel
def _locate(world: int, seen: Seen, memory: int, constants: Location, tables: int, lane: int, n: int) -> int:
    """Writes the joints that an observer finds."""
    s, assumed = Seen(seen.rows[:, :n]), constants.model
    estimate, inputs = PistonEstimate(s.intermediate[: PistonEstimate.size]), Inputs(scratch(Inputs.size)[:, :n])
    informed, pistons = constants.informed > 0.0, Pistons(block(memory, int(constants.rows_of_memory))[:, :n])
    for i in range(n):
        for k in range(2):
            inputs.force[k, i], inputs.believed[k, i] = s.user_force[k, i] if informed else 0.0, 0.0
        inputs.moving[i], inputs.noise[i] = estimate.moving[i] if informed else 1.0, assumed.noise
        inputs.inverse_mass[i] = assumed.rig.inverse_mass
    observe(pistons, s, s.pressure, inputs, assumed)
    for i in range(n):
        for k in range(2):
            estimate.joints.position[k, i], estimate.joints.speed[k, i] = pistons.position[k, i], pistons.speed[k, i]
    return 0


def pistons(rig: Parameters, sampled: bool, informed: bool) -> ControllerStage:
    """Finds the joints, with an observer where positions are samples.

    Where it is ``informed`` it knows the hand's force, and lets pistons rest while nothing is to move.
    """
    if not sampled:
        return ControllerStage(_measure, parameter_column(rig), np.zeros(0))
    fresh = fresh_memory(rig, sampled)
    return ControllerStage(
        _locate, Location.numbers(rows_of_memory=len(fresh), informed=informed, model=assumed_parameters(rig)), fresh
    )
