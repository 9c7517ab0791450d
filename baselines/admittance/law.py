"""A stiff loop that follows a reference motion through friction, as a stage of the closed loop.

The law of ``cartesian_law`` with one gain c for all directions, with the measured force and with what is known of the rest:
    j = jr - 3 c (a - ar) - (3 c^2 + 2) (v - vr) - (c^3 + 2 c) (x - xr),   m a = J^-T L + m g + Fu,
    L_i = F_i - Fext_i - Fv v_i + unseen_i
with the forces unseen of ``estimator``: believed friction and what an observer finds besides.

- While pistons rest (``observers``) position errors weigh ``rest_push`` times as much, since stiction, not inertia, has to be
  overcome, and those within ``dead_zone`` move nothing. Once the reference rests the loop has a gain of its own, softer: what
  noise a slow average leaves must not wear the friction down.
- ``gain_fraction`` lowers c across or along cylinder 2 where the loop oscillates in that direction: the rig is then slower,
  lighter or held more stiffly than believed.
- ``HELD_GAIN`` is what is left of c while a stiff hand is answered (``estimation.stiff_hand``).
- ``rest_gain_fraction`` lowers c for a while where the loop swings at rest, if nothing but friction tells the law of the hand.
- Position errors count up to ``MOST_ERROR``, so that the loop comes back calmly from a load that was beyond its strength.
- ``lead``: the commanded opening takes the spool, whose lag is known, where the law wants it.
"""

import math

from baselines.admittance import estimator
from baselines.admittance.belief import Belief, believe
from baselines.admittance.finding import find
from baselines.admittance.rows import Constants, Estimate, Follower, Gains, Memory, OscillationDetector
from baselines.backstepping.cartesian_law import across, along, load_rates
from baselines.estimation import rig_filter, rig_reader
from baselines.estimation.hand.half_wave import sustained
from baselines.estimation.rig_filter import EAGER, FALLEN, RETURN, RigFilter
from baselines.estimation.rig_reader import RigReader
from baselines.estimation.rows import AssumedParameters
from baselines.valve_inverse import air_at, pressure_openings
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Motion
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.stack import column
from birthsim_env.physics.dynamics import load
from birthsim_env.physics.linkage import geometry, mechanics

MOTION_TIME = 0.1
"""s; assumed: how long the loop stays as stiff as for motion after the reference has come to rest."""

LEAST_REST_FRACTION, REST_REDUCTION, RECOVERY_TIME = 0.55, 0.85, 0.4
"""What is left of the gain of a loop that swings while its motion goes nowhere, at least and after each half wave, and s until
it is back. Found by trial: without a force sensor a stiff hand makes a resting head swing at 14 Hz, and friction ends that."""

NOWHERE, DRIFTING = 8e-3, 3.0
"""m/s and 1/s: a motion goes nowhere while its velocity, low-passed, is below; found by trial."""

HELD_GAIN = 20.0
"""1/s: c while a stiff hand is answered; found by trial. With 15 a hand is pressed by 1.7 times the force (95 %) after 5 s, as
errors of the weight are closed more slowly; with 25 and more, soft bristles swing on."""

MOST_ERROR = 0.006
"""m; assumed: no position error counts for more. A larger one, left by a load beyond what the cylinders can hold, is closed at
a speed of c MOST_ERROR/3, which saturated valves can still stop; else the loop swings between its limits."""


@helper
def gain_fraction(detector: OscillationDetector, i: int, error: float, period: float, gains: Gains) -> float:
    """Gain fraction, lowered by each sustained half wave of a speed error: once for each whole ``oscillation`` of its size."""
    fraction: float = detector.fraction[i]
    peak = sustained(detector, i, error, period, gains.oscillation, 0.0)
    for _ in range(int(min(peak / gains.oscillation, gains.most_falls))):
        fraction = max(gains.least_fraction, gains.yielding * fraction)
    detector.fraction[i] = fraction
    return fraction


@helper
def rest_gain_fraction(detector: OscillationDetector, i: int, error: float, period: float, gains: Gains) -> float:
    """Gain fraction, lowered by each sustained half wave of a speed error beyond ``swing``, which comes back."""
    fraction: float = detector.fraction[i] + period / RECOVERY_TIME * (1.0 - detector.fraction[i])
    if sustained(detector, i, error, period, gains.swing, 0.0) > 0.0:
        fraction = max(LEAST_REST_FRACTION, REST_REDUCTION * fraction)
    detector.fraction[i] = fraction
    return fraction


@helper
def motion_fraction(follower: Follower, i: int, motion: Motion, period: float) -> float:
    """How far the motion of lane ``i`` goes anywhere, 0 to 1."""
    square = 0.0
    for axis in range(2):
        follower.drift[axis, i] += period * DRIFTING * (motion.velocity[axis, i] - follower.drift[axis, i])
        square += follower.drift[axis, i] ** 2
    return min(1.0, square / (NOWHERE * NOWHERE))


@helper
def lead(wanted: float, spool: float, kept: float, quickness: float) -> float:
    """Opening command that takes a spool of known lag a fraction ``quickness`` of the way to ``wanted`` in one period.

    ``kept`` is exp(-period/tau), the fraction of the way that the spool leaves by itself.
    """
    return max(-1.0, min(1.0, spool + quickness * (wanted - spool) / (1.0 - kept)))


@helper
def jerk_for(acceleration: float, speed: float, position: float, c: float) -> float:
    """What errors of acceleration, speed and position take off the jerk with three equal gains c, m/s3."""
    return 3.0 * c * acceleration + (3.0 * c * c + 2.0) * speed + (c * c + 2.0) * c * position


@helper
def beyond(error: float, zone: float) -> float:
    """What of ``error`` exceeds +-``zone``: a dead zone keeps integral action from hunting against stiction."""
    return error - max(-zone, min(zone, error))


@helper
def command(seen: Seen, memory: Memory, estimate: Estimate, gains: Gains, assumed: AssumedParameters) -> None:
    """Writes the openings to ``seen`` and carries ``memory.follower`` on by one period."""
    p, period, motion = assumed.rig, assumed.period, estimate.motion
    hand, asked = estimate.inputs.force, seen.asked
    feedforward, joints = seen.feedforward, memory.joints
    pressure, follower = memory.chambers.pressure, memory.follower
    kept, rest, c4 = exact.exp(-period / p.tau), memory.pistons.rest, gains.pneumatic_gain
    for i in range(memory.fresh.shape[0]):
        y1, y2 = joints.position[0, i], joints.position[1, i]
        v1, v2 = joints.speed[0, i], joints.speed[1, i]
        pp1, pn1 = pressure[0, i], pressure[1, i]
        pp2, pn2 = pressure[2, i], pressure[3, i]
        inverse_mass = estimate.inputs.inverse_mass[i]
        m, gravity, atmosphere = memory.inertia.mass[i], p.gravity, p.atmosphere
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + 2.0 * r4 * w / s2 * v1
        load1 = mechanics.piston_force(pp1, pn1, p.area_p1, p.area_n1, atmosphere) - p.fv1 * v1
        load2 = mechanics.piston_force(pp2, pn2, p.area_p2, p.area_n2, atmosphere) - p.fv2 * v2
        load1 = load1 + estimate.unseen[0, i] + feedforward.force[0, i]
        load2 = load2 + estimate.unseen[1, i] + feedforward.force[1, i]

        # Across (t) and along (n) cylinder 2: errors of position, speed and acceleration.
        ex, ey = r2 * sine - motion.position[0, i], -r2 * cosine - motion.position[1, i]
        et, en = across(ex, ey, sine, cosine), along(ex, ey, sine, cosine)
        dt = -kappa * v1 - across(motion.velocity[0, i], motion.velocity[1, i], sine, cosine)
        dn = v2 - along(motion.velocity[0, i], motion.velocity[1, i], sine, cosine)
        push_t, push_n = across(hand[0, i], hand[1, i], sine, cosine), along(hand[0, i], hand[1, i], sine, cosine)
        ax, ay = motion.acceleration[0, i], motion.acceleration[1, i]
        jx, jy = motion.jerk[0, i], motion.jerk[1, i]
        at_ = (push_t - load1 / kappa) / m - gravity * sine - across(ax, ay, sine, cosine)
        an_ = (push_n + load2) / m + gravity * cosine - along(ax, ay, sine, cosine)

        fraction_t = gain_fraction(follower.across, i, dt, period, gains)
        fraction_n = gain_fraction(follower.along, i, dn, period, gains)
        follower.moved[i] = max(estimate.inputs.moving[i], follower.moved[i] * exact.exp(-period / MOTION_TIME))
        resting = gains.rest_gain * math.sqrt(min(1.0, gains.heavy / p.mass))
        c = resting + (gains.gain - resting) * follower.moved[i]
        c -= memory.stiff_hand.felt[i] * max(0.0, c - HELD_GAIN)
        if gains.swing > 0.0:
            gone = motion_fraction(follower, i, motion, period)
            fraction_t *= gone + (1.0 - gone) * rest_gain_fraction(follower.rest_across, i, dt, period, gains)
            fraction_n *= gone + (1.0 - gone) * rest_gain_fraction(follower.rest_along, i, dn, period, gains)
        et = (1.0 + (gains.rest_push - 1.0) * rest[0, i]) * beyond(et, rest[0, i] * gains.dead_zone)
        en = (1.0 + (gains.rest_push - 1.0) * rest[1, i]) * beyond(en, rest[1, i] * gains.dead_zone)
        et, en = max(-MOST_ERROR, min(MOST_ERROR, et)), max(-MOST_ERROR, min(MOST_ERROR, en))
        jerk_t = across(jx, jy, sine, cosine) - jerk_for(at_, dt, et, fraction_t * c)
        jerk_n = along(jx, jy, sine, cosine) - jerk_for(an_, dn, en, fraction_n * c)
        rate1, rate2 = load_rates(load1, load2, growth, turn, kappa, m * jerk_t, m * jerk_n)
        rate1 += p.fv1 * mechanics.acceleration1(
            load1 - kappa * push_t, v1, v2, r2, r4, w, s2, kappa, sine, inverse_mass, gravity
        )
        rate2 += p.fv2 * mechanics.acceleration2(load2 + push_n, v1, r2, r4, s2, cosine, inverse_mass, gravity)
        rate1, rate2 = rate1 - feedforward.rate[0, i], rate2 - feedforward.rate[1, i]
        stiffness, stiffness_rate = asked.pneumatic_stiffness, asked.pneumatic_stiffness_rate
        first, second = air_at(0, pp1, pn1, y1, v1, p), air_at(1, pp2, pn2, y2, v2, p)
        p1, n1 = pressure_openings(rate1, stiffness[0, i], stiffness_rate[0, i], c4, first, p)
        p2, n2 = pressure_openings(rate2, stiffness[1, i], stiffness_rate[1, i], c4, second, p)
        for valve, wanted in ((0, p1), (1, n1), (2, p2), (3, n2)):
            seen.opening[valve, i] = lead(wanted, memory.chambers.spool[valve, i], kept, gains.quickness)


@helper
def advance(seen: Seen, whole: Array, estimate: Estimate, constants: Constants) -> int:
    """One control period of all lanes of ``seen``, whose memory and bank are ``whole``; returns what ``control`` does."""
    own, bank = estimator.parts(whole, constants)
    missed = estimator.estimate(seen, own, bank, estimate, constants)
    command(seen, own, estimate, constants.gains, constants.model)
    load(seen.opening, 0, own.fresh.shape[0], own.chambers.opening)
    return missed


@kernel
def control(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are not positive definite."""
    signals, estimate = Seen(seen.rows[:, :n]), Estimate(scratch(Estimate.size)[:, :n])
    return advance(signals, block(memory, int(constants.rows_of_memory))[:, :n], estimate, constants)


@kernel
def control_each(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    """``control`` where every lane has a belief of its own, behind what it remembers."""
    rows, found, missed = int(constants.rows_of_memory), int(constants.rows_of_finder), 0
    believing, read = rows + Belief.size, int(constants.rows_of_reader)
    whole, beliefs = block(memory, rows), Belief(block(memory, believing)[rows:])
    remembered, bank = estimator.parts(whole, constants)
    for i in range(n):
        signals, estimate = Seen(seen.rows[:, i : i + 1]), Estimate(scratch(Estimate.size)[:, :1])
        own = Constants(column(Constants.size))
        if found > 0:
            finder = RigFilter(block(memory, believing + found)[believing:])
            moved = remembered.follower.moved[i]
            if FALLEN < finder.age[i] < EAGER:
                remembered.follower.moved[i] = max(moved, RETURN)
            eager = 1.0 if finder.age[i] < EAGER else moved
            left = believe(beliefs, i, seen, remembered, bank, constants, own, eager)
            if find(finder, i, seen, remembered, constants, own, left):
                rig_filter.bound(finder, i, constants.spread)
                if read > 0:
                    reader = RigReader(block(memory, believing + found + read)[believing + found :])
                    rig_reader.read(reader, finder, i, moved, constants.spread, tables, lane + i)
                    if finder.heeded[i] > 0.0:
                        rig_reader.heed(reader, finder, i)
                elif finder.heeded[i] > 0.0:
                    rig_filter.heed(finder, i)
                rig_filter.tell(finder, i, constants.model.rig, beliefs.told)
        else:
            believe(beliefs, i, seen, remembered, bank, constants, own, 1.0)
        missed += advance(signals, whole[:, i : i + 1], estimate, own)
    return missed
