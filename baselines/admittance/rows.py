"""Rows of the admittance law: what it remembers, what it knows at one instant, and its constants."""

from baselines.estimation import rig_filter
from baselines.estimation.admittance import Compliance
from baselines.estimation.chamber_observer import Chambers
from baselines.estimation.friction_level import Friction
from baselines.estimation.friction_observer import Found
from baselines.estimation.hand.bristle_observer import ContactForce
from baselines.estimation.hand.force_observer import Hand
from baselines.estimation.hand.half_wave import HalfWave
from baselines.estimation.hand.held_force import RestDetector
from baselines.estimation.inertia import Inertia
from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from baselines.estimation.stiff_hand import StiffHand
from baselines.estimation.tracker_noise import Tracker
from birthsim_env.loop.signals import Joints, Motion, Point
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows


class OscillationDetector(HalfWave):
    """Oscillation in one direction."""

    fraction = row("1", "fraction of the gain that oscillations have left; 1 at a new start")


class Follower(Rows):
    """What the loop that follows the motion remembers."""

    across = part(OscillationDetector, "across cylinder 2")
    along = part(OscillationDetector, "along cylinder 2")
    rest_across = part(OscillationDetector, "across cylinder 2, at rest")
    rest_along = part(OscillationDetector, "along cylinder 2, at rest")
    drift = rows("vx vy", "m/s", "low-passed velocity of the motion")
    moved = row("1", "how far the motion was moving of late, 0 to 1")


class Memory(Rows):
    """What the law remembers."""

    fresh = row("1", "1 at a new start")
    offset = part(Point, "motion from the target; zero at a new start")
    bristle = rows("z1 z2", "m", "deflection along the motion")
    chambers = part(Chambers, "valves and chambers")
    joints = part(Joints, "pistons a period ago")
    tracker = part(Tracker, "noise of the tracker")
    bias = rows("bias_x bias_y", "N", "bias of the force sensor")
    friction = part(Friction, "level of friction")
    inertia = part(Inertia, "mass")
    travels = row("1", "how far the target was moving of late, 0 to 1")
    hand = part(Hand, "force of the hand without a sensor")
    contact = part(ContactForce, "the same where friction is known")
    rest_detector = part(RestDetector, "whether the head rests, without a force sensor")
    stiff_hand = part(StiffHand, "whether a stiff hand makes the head swing")
    follower = part(Follower, "loop")
    pistons = part(Pistons, "observer")


class Estimate(Rows):
    """What the law knows at one instant, besides what it remembers."""

    motion = part(Motion, "motion that the hand should find")
    inputs = part(Inputs, "to the observer of the pistons")
    unseen = rows("U1 U2", "N", "all that is unseen along the pistons: friction as believed and what is observed besides")
    drag = rows("drag1 drag2", "N", "friction along the motion, as believed of the rig")
    found = part(Found, "pistons as candidates for their friction have them")
    unexplained = rows("R1 R2", "N", "what pressures, weight, motion and measured force leave unexplained along the pistons")
    hand = rows("Fx Fy", "N", "force of the hand, measured or found")
    heavier = row("1", "what multiplies the mass that the hand should find")
    damping_factor = row("1", "what multiplies its damping")


class EstimatorParameters(Numbers):
    """What the law believes of rig and sensors, and what it is to learn of them."""

    model = part(AssumedParameters, "of the observer of the pistons")
    compliance = part(Compliance, "what gives way")
    sampled = number("1", "1 where positions are samples")
    force_sensor = number("1", "1 with a force sensor")
    weighed = number("1", "1 where an acceleration sensor tells the hand's force")
    identified = number("1", "1 where friction is known and tells the hand's force")
    believed_limit = number("N", "that is believed to act unseen on a piston, at most")
    learns_noise = number("1", "1 where the tracker's noise is learned")
    place = number("1", "row of ``Seen`` at which a ``Point`` stands")
    rows_of_memory = number("1", "rows of the memory and of the bank of candidates after it")
    rows_of_bank = number("1", "rows of that bank; 0 without one")
    trust = number("1", "trust in a pressure cell, 0 to 1")
    friction_fraction = number("1", "fraction of the believed friction that is fed forward")
    learns_mass = number("1", "1 where the mass is learned")
    weighs_friction = number("1", "1 where candidates for the friction are weighed, which a head at rest is followed by")
    friction_rate = number("1/s", "rate at which the level of friction is learned; 0 learns nothing")
    feels_stiff_hand = number("1", "1 where a stiff hand that makes the head swing is answered")
    most_bias = number("N", "largest bias of the force sensor that is taken off; 0 takes nothing")


class Gains(Numbers):
    """Gains of the loop that follows the motion."""

    pneumatic_gain = number("1/s", "c4")
    gain = number("1/s", "c while the motion moves")
    rest_gain = number("1/s", "c while it rests")
    heavy = number("kg", "mass beyond which c at rest is less by the root of the ratio")
    rest_push = number("1", "weight of a resting piston's position error")
    dead_zone = number("m", "of a resting piston's position error")
    quickness = number("1", "fraction of the way that a spool is taken in a period")
    oscillation = number("m/s", "speed error beyond which sustained half waves lower c")
    swing = number("m/s", "speed error beyond which sustained half waves lower c at rest for a while; 0: none do")
    yielding = number("1", "what such a half wave leaves of c")
    least_fraction = number("1", "what is left of c at least")
    most_falls = number("1", "times that a half wave lowers c at most: one n times ``oscillation`` lowers it n times")


class Constants(EstimatorParameters):
    """Constants of the stage."""

    gains = part(Gains, "of the loop")
    rows_of_finder = number("1", "rows of the filter that finds the rig; 0 where none does")
    rows_of_reader = number("1", "rows of the network that reads the rig; 0 where none does")
    cell_noise = number("Pa", "standard deviation of a pressure cell")
    spread = rows(rig_filter.SIZE, "1", "standard deviation of the logarithms of what the filter finds, over rigs")
