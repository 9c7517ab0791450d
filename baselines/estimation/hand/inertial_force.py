"""The hand's force with an acceleration sensor: what moves the head, less what pressures, weight and friction explain.

    F = m (a - g) - J^-T (F_chambers - friction)
Friction is that of candidates that ``friction_candidates`` carries on through rest and motion and weighs. A sliding piston
shows its bristles by its speed, which ``inertial`` finds without a model of rig or hand. At rest that speed is noise, which
would wear them down, and the model of the rig moves them instead. What is left of the noise at rest is held (``held_force``).

What is left at the start, before a hand comes, is taken for an error of the mass and of the pressure cells.
"""

import math

from baselines.estimation import dry_friction
from baselines.estimation.hand import force_bias, friction_candidates, held_force
from baselines.estimation.hand.bristle_filter import SLIDES
from baselines.estimation.hand.bristled_pistons import LATE, loads
from baselines.estimation.hand.force_observer import MOST_BIAS, Hand
from baselines.estimation.hand.friction_candidates import Bank
from baselines.estimation.hand.held_force import RestDetector
from baselines.estimation.inertial import Moving
from baselines.estimation.rows import AssumedParameters
from birthsim_env.loop.rows import POSITION, Signals
from birthsim_env.loop.signals import Joints, PerChamber, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion

QUICKNESS = 500.0
"""1/s, of the low-pass on the force; found by trial. A slower one makes the head swing against a clamp."""

PUSH_NOISE, WEIGHED = 0.3, 0.15
"""N2/s and m/s2: density of the noise that drives the hand's force, until innovations tell of more, and standard deviation of
an acceleration; found by trial. The sensor's low-pass and the model of the pressures count as noise, too."""

SPEED_AT_REST, SPEED_SLIDING = 5e-3, 3e-5
"""m/s: standard deviations of a speed that ``inertial`` finds, found by trial. Its errors of 0.24 mm/s last for 0.1 s, in which
a resting piston's bristles would gather them. Those of a sliding one forget them."""

UNSEEN = 0.1
"""Part of the variance of a piston's speed that is motion: valves shake a resting piston by 0.1 to 0.3 mm/s, of which 0.07 mm/s
are not seen, a third of what the filter believes. Found by trial; with 0 bristles were believed 0.3 N too bent after a stop."""


@helper
def observe(
    hand: Hand,
    detector: RestDetector,
    bank: Bank,
    seen: Signals,
    moving: Moving,
    joints: Joints,
    pressures: Array,
    noise: Array,
    assumed: AssumedParameters,
    fresh: Array,
) -> None:
    """Carries ``hand``, ``detector`` and ``bank`` on by one period.

    ``bank`` has the candidates for friction, ``moving`` is the end effector, ``pressures`` (4, N), Pa, the chambers', ``noise``
    (N,), m, that of a position sample.
    """
    p, period, air = assumed.rig, assumed.period, PerChamber(pressures)
    sample, bare = Joints(scratch(Joints.size)), scratch(2)[:, : fresh.shape[0]]
    piston_motion(seen.rows[POSITION : POSITION + Point.size], p, sample.rows, fresh.shape[0])
    share = period / (1.0 / QUICKNESS + period)
    for i in range(fresh.shape[0]):
        pose = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        _, _, _, _, _, kappa, sine, cosine = pose
        is_sampled, new = seen.position_time[i] > bank.newest[i], fresh[i] > 0.0
        bank.newest[i] = seen.position_time[i]
        age = seen.time[i] - seen.position_time[i]
        load1, load2, own1, own2 = loads(i, joints, air, pose, p)
        ax, ay = moving.acceleration[0, i], moving.acceleration[1, i] + p.gravity
        left1 = -kappa * p.mass * (ax * cosine + ay * sine) - load1
        left2 = p.mass * (ax * sine - ay * cosine) - load2
        if new:
            friction_candidates.begin(bank, i)
        bank.since[i] += period
        drag1, drag2 = 0.0, 0.0
        for k in range(2):
            v, lever = joints.speed[k, i], kappa if k == 0 else 1.0
            told = friction_candidates.Seen(
                joints.position[k, i],
                v,
                max(SPEED_SLIDING, SPEED_AT_REST / (1.0 + (v / SLIDES) ** 2)),
                load1 if k == 0 else load2,
                own1 if k == 0 else own2,
                p.mass * lever * lever,
                dry_friction.level_at(k, air.rows, i, p),
                left1 if k == 0 else left2,
                lever * WEIGHED * p.mass,
                is_sampled,
                sample.position[k, i] + v * age,
                noise[i] / lever + LATE * abs(v),
            )
            drag = friction_candidates.follow(bank, k, i, told, PUSH_NOISE, UNSEEN, p, period, new)
            drag1, drag2 = drag if k == 0 else drag1, drag2 if k == 0 else drag
        across, along = -(left1 + drag1) / kappa, left2 + drag2
        x, y = across * cosine + along * sine, across * sine - along * cosine
        hand.filtered[0, i] = 0.0 if new else hand.filtered[0, i] + share * (x - hand.filtered[0, i])
        hand.filtered[1, i] = 0.0 if new else hand.filtered[1, i] + share * (y - hand.filtered[1, i])
    force_bias.tare(hand.bias, seen.time, hand.filtered, MOST_BIAS, math.inf, period, bare)
    held_force.hold(detector, bare, period, fresh, hand.force)
