"""``admittance-adaptive`` as a stage: that of ``admittance.stage``, with what is learned of the sensors and of friction.

What a lane has learned of its tracker and its pistons are numbers of its own, so that the observer and the law run lane by
lane.
"""

from __future__ import annotations

import numpy as np

from baselines.admittance import law as admittance_law
from baselines.estimation import (
    admittance,
    chamber_observer,
    disturbance_observer,
    force_bias,
    force_observer,
    friction_level,
    reference_friction,
    tracker_noise,
)
from baselines.estimation.observers import REST, observe
from baselines.estimation.state_estimator import disturbance_forces
from birthsim_env.loop.rows import (
    ACTION,
    ASKED,
    DAMPING,
    FEEDFORWARD,
    OPENING,
    POSITION_TIME,
    PRESSURE,
    REFERENCE,
    SEEN,
    SHOWN,
    TIME,
    USER_FORCE,
)
from birthsim_env.loop.stage import block, numbers, scratch
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import kernel

OFFSET, FRESH, BRISTLES, SPOOLS, PRESSURES, OPENED, JOINTS, LAW = 0, 4, 5, 7, 11, 15, 19, 23
TRACKER = LAW + admittance_law.MEMORY
BIAS = TRACKER + tracker_noise.ROWS
FRICTION = BIAS + force_bias.ROWS
HAND = FRICTION + friction_level.ROWS
FELT = HAND + force_observer.ROWS
PISTONS = FELT + 2
"""Rows of memory at which its parts begin: offset of the compliant motion; 1 at a new start; bristles; spools, pressures and
openings of the four chambers; joints a period ago; the law's own; tracker's noise; bias of the force; level of friction; the
observer of the hand's force and what it found a period ago; the observer of the pistons."""

CONSTANTS = (
    *("sampled", "rows", "period", "mass", "ratio", "friction_fraction", "trust", "bandwidth", "noise", "force_bias"),
    *("friction_rate", "force_sensor", "place"),
    *admittance_law.GAIN_NAMES,
)
"""Those of ``admittance.stage``, with ``noise`` and the largest ``force_bias``, N, as believed; rate, 1/s, at which friction is
learned; 1 with a force sensor, 0 without; row of what is seen at which x, y, vx, vy stand. The rig follows."""
(
    SAMPLED, MEMORY_ROWS, PERIOD, MASS, RATIO, FRACTION, TRUST, BANDWIDTH, NOISE, FORCE_BIAS,
    FRICTION_RATE, FORCE_SENSOR, PLACE, GAINS,
) = range(14)  # fmt: skip
NUMBERS = len(CONSTANTS)


@kernel
def control(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are not positive definite."""
    s, about = block(seen, SEEN), numbers(constants, NUMBERS + at.PARAMETERS)
    p, period, sampled = about[NUMBERS:], about[PERIOD], about[SAMPLED] > 0.0
    m = block(memory, PISTONS + int(about[MEMORY_ROWS]))[:, :n]
    own, push, missed = scratch(21)[:, :n], scratch(2)[:, :n], 0
    motion, believed, disturbance, disturbance_force = own[:8], own[8:10], own[10:12], own[12:14]
    rest, moving, force, fresh = own[14:16], own[16], own[17:19], m[FRESH]
    place = int(about[PLACE])
    time, position, velocity = s[TIME, :n], s[place : place + 2, :n], s[place + 2 : place + 4, :n]
    target, told, openings = s[ASKED:FEEDFORWARD, :n], s[FEEDFORWARD:ACTION, :n], s[OPENING:SHOWN, :n]
    spools, pressures, opened, joints = m[SPOOLS:PRESSURES], m[PRESSURES:OPENED], m[OPENED:JOINTS], m[JOINTS:LAW]
    pistons, levels, unexplained = m[PISTONS:], m[FRICTION:HAND], own[19:21]
    for i in range(n):
        missed += 0 if admittance.is_stiffer(target[8, i], target[9, i], target[14, i], 0.0) else 1
        rest[0, i], rest[1, i] = 0.0, 0.0
    for i in range(n):
        for k in range(2):
            force[k, i] = s[USER_FORCE + k, i] if about[FORCE_SENSOR] > 0.0 else m[FELT + k, i]
    if sampled:
        tracker_noise.observe(m[TRACKER:BIAS], position, s[POSITION_TIME, :n], about[NOISE], fresh)
    if about[FORCE_BIAS] > 0.0:
        force_bias.tare(m[BIAS:FRICTION], time, s[USER_FORCE:REFERENCE, :n], about[FORCE_BIAS], period, force)
    admittance.give_way(m[OFFSET:FRESH], target, force, about[MASS], about[RATIO], period, s[DAMPING, :n], motion)
    admittance.mark_moving(motion, moving)
    chamber_observer.observe(spools, pressures, opened, s[PRESSURE:USER_FORCE, :n], joints, p, period, about[TRUST], fresh)
    reference_friction.rub(motion, p, period, m[BRISTLES:SPOOLS], believed)
    drag = disturbance
    for i in range(n):
        for k in range(2):
            if fresh[i] > 0.0:
                levels[friction_level.LEVEL + k, i] = 1.0
            drag[k, i] = believed[k, i]
            # Without a force sensor the hand is part of what the observers find.
            push[k, i] = force[k, i] if about[FORCE_SENSOR] > 0.0 else 0.0
            believed[k, i] = -about[FRACTION] * levels[friction_level.LEVEL + k, i] * drag[k, i]
    for i in range(n):
        one = slice(i, i + 1)
        if sampled:
            noise = np.sqrt(m[TRACKER + tracker_noise.VARIANCE, i])
            observe(
                pistons[:, one], time[one], position[:, one], s[POSITION_TIME, i : i + 1], velocity[:, one],
                pressures[:, one], p, period, about[BANDWIDTH], noise, push[:, one], believed[:, one],
                moving[one],
            )  # fmt: skip
        else:
            disturbance_observer.observe(
                pistons[:, one], position[:, one], velocity[:, one], pressures[:, one], push[:, one], believed[:, one], p,
                period, about[BANDWIDTH], fresh[one], joints[:, one],
            )  # fmt: skip
        if sampled:
            for k in range(4):
                joints[k, i] = pistons[k, i]
            for k in range(2):
                rest[k, i] = pistons[REST + k, i]
        first = 4 if sampled else 2
        kappa = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )[5]
        unexplained[0, i] = believed[0, i] + p[at.MASS] * kappa * kappa * pistons[first, i]
        unexplained[1, i] = believed[1, i] + p[at.MASS] * pistons[first + 1, i]
    friction_level.learn(
        levels, drag, p[at.FC1], p[at.FC2], joints, unexplained, period, about[FRICTION_RATE] * about[FORCE_SENSOR], fresh
    )  # fmt: skip
    force_observer.observe(m[HAND:FELT], time, joints, unexplained, p, period, fresh, m[FELT:PISTONS])
    for i in range(n):
        disturbance[0, i], disturbance[1, i] = pistons[4 if sampled else 2, i], pistons[5 if sampled else 3, i]
    disturbance_forces(joints, believed, disturbance, p, disturbance_force)
    admittance_law.command(
        joints, pressures, motion, target, push, disturbance_force, rest, moving, spools, p, period, about[GAINS:NUMBERS],
        told, m[LAW:TRACKER], openings,
    )  # fmt: skip
    for i in range(n):
        fresh[i] = 0.0
        for valve in range(4):
            opened[valve, i] = openings[valve, i]
    return missed
