"""Rows that the parts of an estimate share."""

from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows


class Pistons(Joints):
    """What an observer of the pistons remembers."""

    disturbance = rows("d1 d2", "m/s2", "acceleration that is not explained")
    rest = rows("rest1 rest2", "1", "how far a piston rests, 0 to 1")
    innovation = rows("innovation1 innovation2", "m", "low-passed innovation")
    reluctance = rows("reluctance1 reluctance2", "1", "factor of the time in which a piston comes to rest")
    fresh = row("1", "1 at a new start")
    newest = row("s", "time of the newest sample")
    slot = row("1", "where in the past the present stands")
    past = rows(0, "m", "y1, y2 of the last periods in turns, a ring; none where speeds are measured")


class Inputs(Rows):
    """What an observer of the pistons is given besides samples and pressures."""

    force = rows("Fx Fy", "N", "force of the hand, as far as it is known")
    believed = rows("F1 F2", "N", "other forces that are believed to act along the pistons")
    inverse_mass = row("1/kg", "1/mass of what the pistons move")
    moving = row("1", "1 where no piston may rest")
    noise = row("m", "standard deviation of a position sample")


class AssumedParameters(Numbers):
    """What an observer of the pistons believes of the rig."""

    period = number("s", "control period")
    bandwidth = number("1/s", "bandwidth of the observer")
    noise = number("m", "standard deviation of a position sample")
    rig = part(Rig, "the rig as described")
