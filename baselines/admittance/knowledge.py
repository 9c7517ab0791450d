"""What the admittance law knows at one instant, in the order in which it comes to know it.

- sense: the hand's force and the noise of the tracker, as measured and believed or as learned;
- give way: the motion that the hand should find;
- predict: spools, pressures and the friction along that motion;
- correct: positions and speeds of the pistons, and what accelerates them without being known;
- learn: the level of friction from what is left unexplained, and without a force sensor the hand's force.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from baselines.estimation import (
    admittance,
    chamber_observer,
    disturbance_observer,
    force_bias,
    force_observer,
    friction_level,
    observers,
    reference_friction,
    tracker_noise,
)
from birthsim_env.loop.rows import (
    ASKED,
    DAMPING,
    FEEDFORWARD,
    POSITION,
    POSITION_TIME,
    PRESSURE,
    REFERENCE,
    TIME,
    USER_FORCE,
)
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

OFFSET, FRESH, BRISTLES, SPOOLS, PRESSURES, OPENED, JOINTS, TRACKER = 0, 4, 5, 7, 11, 15, 19, 23
BIAS = TRACKER + tracker_noise.ROWS
FRICTION = BIAS + force_bias.ROWS
HAND = FRICTION + friction_level.ROWS
FELT = HAND + force_observer.ROWS
MEMORY = FELT + 2
"""Rows of memory at which its parts begin: offset of the compliant motion; 1 at a new start; bristles; spools, pressures and
openings of the four chambers; joints; tracker's noise; bias of the force; level of friction; the observer of the hand's force
and what it found. ``MEMORY`` is their number; a law's own rows and the observer of the pistons follow."""

CONSTANTS = (
    *("sampled", "force_sensor", "learn", "place", "rows", "period", "mass", "ratio", "noise", "force_bias"),
    *("trust", "bandwidth", "friction_fraction", "friction_rate"),
)
"""1 with sampled positions, 1 with a force sensor, 1 where the tracker's noise is learned; row of the measurement at which x,
y, vx, vy stand; rows of the observer of the pistons; control period, s; mass, kg, and damping ratio of the compliant motion;
noise, m, of a sample and the largest bias of the force, N, as believed; trust in a pressure cell, 0 to 1; bandwidth, 1/s, of
the observer of the pistons; fraction of friction fed forward; rate, 1/s, at which its level is learned, or 0."""
(
    SAMPLED, FORCE_SENSOR, LEARN, PLACE, ROWS, PERIOD, MASS, RATIO, NOISE, FORCE_BIAS, TRUST, BANDWIDTH, FRACTION, RATE,
) = range(14)  # fmt: skip

MOTION, MOVING, FORCE, BELIEVED, UNSEEN, DRAG, LEFT, TOUCH, SPREAD, KNOWN = 0, 8, 9, 11, 13, 15, 17, 19, 21, 22
"""Rows of what is known: the motion that the hand should find; 1 where it moves; the hand's force that is measured, N; friction
and all that is unseen along the pistons, N; friction along the motion as believed, N; what the measured forces leave
unexplained along the pistons, N; the hand's force, measured or not, N; noise of a sample, m. ``KNOWN`` is their number."""

BELIEVED_LIMIT = 120.0
"""N; assumed: no more than this is believed to act unseen on a piston: 2 kg of mass and 25 N of friction are below it."""


@helper
def sense(s: Array, m: Array, about: Array, known: Array, n: int) -> None:
    """Writes ``TOUCH``, ``FORCE`` and ``SPREAD``. What no force sensor tells of the hand, the observers find."""
    for i in range(n):
        known[SPREAD, i] = about[NOISE]
        for k in range(2):
            known[TOUCH + k, i] = s[USER_FORCE + k, i] if about[FORCE_SENSOR] > 0.0 else m[FELT + k, i]
    if about[LEARN] > 0.0 and about[SAMPLED] > 0.0:
        place = int(about[PLACE])
        tracker_noise.observe(m[TRACKER:BIAS], s[place : place + 2, :n], s[POSITION_TIME, :n], about[NOISE], m[FRESH])
        for i in range(n):
            known[SPREAD, i] = math.sqrt(m[TRACKER + tracker_noise.VARIANCE, i])
    if about[FORCE_BIAS] > 0.0:
        force_bias.tare(
            m[BIAS:FRICTION], s[TIME, :n], s[USER_FORCE:REFERENCE, :n], about[FORCE_BIAS], about[PERIOD],
            known[TOUCH : TOUCH + 2],
        )  # fmt: skip
    for i in range(n):
        for k in range(2):
            known[FORCE + k, i] = known[TOUCH + k, i] if about[FORCE_SENSOR] > 0.0 else 0.0


@helper
def give_way(s: Array, m: Array, about: Array, known: Array, n: int) -> int:
    """Writes ``MOTION`` and ``MOVING``; returns how many stiffness setpoints are not positive definite."""
    target, motion, missed = s[ASKED:FEEDFORWARD, :n], known[MOTION:MOVING], 0
    for i in range(n):
        missed += 0 if admittance.is_stiffer(target[8, i], target[9, i], target[14, i], 0.0) else 1
    admittance.give_way(
        m[OFFSET:FRESH], target, known[TOUCH : TOUCH + 2], about[MASS], about[RATIO], about[PERIOD], s[DAMPING, :n], motion
    )
    admittance.mark_moving(motion, known[MOVING])
    return missed


@helper
def predict(s: Array, m: Array, about: Array, known: Array, p: Array, n: int) -> None:
    """Carries spools, pressures and bristles on; writes ``DRAG`` and ``BELIEVED``."""
    chamber_observer.observe(
        m[SPOOLS:PRESSURES], m[PRESSURES:OPENED], m[OPENED:JOINTS], s[PRESSURE:USER_FORCE, :n], m[JOINTS:TRACKER], p,
        about[PERIOD], about[TRUST], m[FRESH],
    )  # fmt: skip
    reference_friction.rub(known[MOTION:MOVING], p, about[PERIOD], m[BRISTLES:SPOOLS], known[DRAG:LEFT])
    for i in range(n):
        for k in range(2):
            level = m[FRICTION + friction_level.LEVEL + k, i]
            known[BELIEVED + k, i] = -about[FRACTION] * level * known[DRAG + k, i]


@helper
def correct(s: Array, m: Array, pistons: Array, about: Array, known: Array, p: Array, n: int) -> None:
    """Carries ``pistons`` on, and writes ``UNSEEN``."""
    place, pressures, force, believed = int(about[PLACE]), m[PRESSURES:OPENED], known[FORCE:BELIEVED], known[BELIEVED:UNSEEN]
    position, velocity, joints = s[place : place + 2, :n], s[place + 2 : place + 4, :n], m[JOINTS:TRACKER]
    if about[SAMPLED] > 0.0:
        observers.observe(
            pistons, s[TIME, :n], position, s[POSITION_TIME, :n], velocity, pressures, p, about[PERIOD], about[BANDWIDTH],
            known[SPREAD], force, believed, known[MOVING],
        )  # fmt: skip
        for k in range(4):
            for i in range(n):
                joints[k, i] = pistons[observers.ESTIMATE + k, i]
    else:
        disturbance_observer.observe(
            pistons[observers.SPEED : observers.REST], position, velocity, pressures, force, believed, p, about[PERIOD],
            about[BANDWIDTH], m[FRESH], joints,
        )  # fmt: skip
    for i in range(n):
        kappa = geometry.pose(
            joints[0, i], joints[1, i], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )[5]
        for k in range(2):
            found = (p[at.MASS] * kappa * kappa if k == 0 else p[at.MASS]) * pistons[observers.DISTURBANCE + k, i]
            known[LEFT + k, i] = believed[k, i] + found
            known[UNSEEN + k, i] = believed[k, i] + max(-BELIEVED_LIMIT, min(BELIEVED_LIMIT, found))


@helper
def learn(s: Array, m: Array, about: Array, known: Array, p: Array) -> None:
    """Brings up the level of friction and, without a force sensor, the hand's force, for the next period."""
    joints, left = m[JOINTS:TRACKER], known[LEFT:TOUCH]
    if about[RATE] > 0.0:
        friction_level.learn(
            m[FRICTION:HAND], known[DRAG:LEFT], p[at.FC1], p[at.FC2], joints, left, about[PERIOD], about[RATE], m[FRESH]
        )
    if about[FORCE_SENSOR] == 0.0:
        force_observer.observe(m[HAND:FELT], s[TIME], joints, left, p, about[PERIOD], m[FRESH], m[FELT:MEMORY])


@helper
def know(s: Array, m: Array, pistons: Array, about: Array, p: Array, known: Array, n: int) -> int:
    """Carries memory and ``pistons`` of a block on by one control period and writes ``known`` (KNOWN, n).

    Returns how many stiffness setpoints are not positive definite.
    """
    sense(s, m, about, known, n)
    missed = give_way(s, m, about, known, n)
    predict(s, m, about, known, p, n)
    correct(s, m, pistons, about, known, p, n)
    learn(s, m, about, known, p)
    for i in range(n):
        m[FRESH, i] = 0.0
    return missed


def pistons_memory(rig: Parameters, sampled: bool) -> Array:
    """The memory of the observer of the pistons in a lane that starts."""
    return observers.fresh_memory(rig) if sampled else np.zeros(observers.INNOVATION)


def fresh_memory() -> Array:
    """The other rows of a lane that starts."""
    fresh = np.zeros(MEMORY)
    fresh[FRESH], fresh[FRICTION + friction_level.LEVEL : FRICTION + friction_level.OFFSET] = 1.0, 1.0
    return fresh


def constants(rig: Parameters, sampled: bool, noisy: bool, gains: Mapping[str, float], **others: float) -> list[float]:
    """``CONSTANTS`` for a rig as believed: with a force sensor and nothing learned, where ``others`` do not say otherwise.

    ``gains`` has bandwidth and friction_fraction and, where cells are ``noisy``, pressure_bandwidth, 1/s.
    """
    board, width = rig.electronics, gains["pressure_bandwidth"] if noisy else math.inf
    values = {
        **{"sampled": sampled, "force_sensor": True, "learn": False, "place": POSITION},
        **{"rows": len(pistons_memory(rig, sampled)), "period": board.control_period, "mass": rig.mechanics.mass},
        **{"ratio": admittance.DAMPING_RATIO, "noise": board.position_noise, "force_bias": 0.0, "friction_rate": 0.0},
        **{"trust": 1.0 - exact.number("exp", -width * board.control_period), "bandwidth": gains["bandwidth"]},
        **{"friction_fraction": gains["friction_fraction"], **others},
    }
    return [float(values[name]) for name in CONSTANTS]
