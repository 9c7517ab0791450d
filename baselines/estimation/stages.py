"""Stages that laws share: the motion that the hand should find, and where the pistons are."""

import numpy as np

from baselines.estimation.admittance import DAMPING_RATIO, Compliance, give_way, mark_moving
from baselines.estimation.observers import belief, fresh_memory, observe
from baselines.estimation.rows import Belief, Given, Pistons
from baselines.staged import LawStage
from birthsim_env.loop.rows import HANDED, POSITION, Seen
from birthsim_env.loop.signals import Joints, Motion, Point
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row
from birthsim_env.physics.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.parameters import Parameters


class Estimate(Rows):
    """What these stages hand on. A law's own rows follow."""

    motion = part(Motion, "motion that the hand should find")
    moving = row("1", "1 where that motion is faster than ``MOVING_SPEED``, else 0")
    joints = part(Joints, "measured or estimated")


MOTION, MOVING, JOINTS, OWN = (
    HANDED + first for first in (Estimate.motion.first, Estimate.moving.first, Estimate.joints.first, Estimate.size)
)


@kernel
def _comply(world: int, seen: Seen, offset: Point, about: Compliance, tables: int, lane: int, n: int) -> int:
    """Writes motion and ``moving``; returns how many stiffness setpoints are not positive definite."""
    s = Seen(seen.rows[:, :n])
    estimate = Estimate(s.handed[: Estimate.size])
    missed = give_way(Point(offset.rows[:, :n]), s.asked, s.user_force, about, s.damping_factor, estimate.motion)
    mark_moving(estimate.motion, estimate.moving)
    return missed


def compliance(rig: Parameters) -> Array:
    """``Compliance`` with the mass of the rig."""
    return Compliance.numbers(mass=rig.mechanics.mass, damping_ratio=DAMPING_RATIO, period=rig.electronics.control_period)


def compliant_motion(rig: Parameters) -> LawStage:
    """Turns the measured force into the motion that the hand should find."""
    return LawStage(_comply, compliance(rig), Point.lane())


@kernel
def _measure(world: int, seen: Seen, memory: int, rig: Rig, tables: int, lane: int, n: int) -> int:
    """Writes the joints that are measured."""
    joints = Estimate(seen.handed[: Estimate.size]).joints
    piston_motion(seen.rows[POSITION : POSITION + Point.size], rig, joints.rows, n)
    return 0


class Location(Numbers):
    """Constants of the stage that observes the pistons."""

    rows_of_memory = number("1", "rows of the observer")
    informed = number("1", "1 where the observer knows the force of the hand and whether the motion moves")
    belief = part(Belief, "of the observer")


@kernel
def _locate(world: int, seen: Seen, memory: int, about: Location, tables: int, lane: int, n: int) -> int:
    """Writes the joints that an observer finds."""
    s, belief = Seen(seen.rows[:, :n]), about.belief
    estimate, given = Estimate(s.handed[: Estimate.size]), Given(scratch(Given.size)[:, :n])
    informed, pistons = about.informed > 0.0, Pistons(block(memory, int(about.rows_of_memory))[:, :n])
    for i in range(n):
        for k in range(2):
            given.force[k, i], given.believed[k, i] = s.user_force[k, i] if informed else 0.0, 0.0
        given.moving[i], given.noise[i] = estimate.moving[i] if informed else 1.0, belief.noise
        given.inverse_mass[i] = belief.rig.inverse_mass
    observe(pistons, s, s.pressure, given, belief)
    for i in range(n):
        for k in range(2):
            estimate.joints.position[k, i], estimate.joints.speed[k, i] = pistons.position[k, i], pistons.speed[k, i]
    return 0


def pistons(rig: Parameters, sampled: bool, informed: bool) -> LawStage:
    """Finds the joints, with an observer where positions are samples.

    Where it is ``informed`` it knows the hand's force, and lets pistons rest while nothing is to move.
    """
    if not sampled:
        return LawStage(_measure, parameter_column(rig), np.zeros(0))
    fresh = fresh_memory(rig, sampled)
    return LawStage(_locate, Location.numbers(rows_of_memory=len(fresh), informed=informed, belief=belief(rig)), fresh)
