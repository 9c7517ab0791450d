"""Stages that laws share: the motion that the hand should find, and where the pistons are."""

from __future__ import annotations

import numpy as np

from baselines.estimation.admittance import DAMPING_RATIO, give_way, is_stiffer, mark_moving
from baselines.estimation.observers import BANDWIDTH, ESTIMATE, fresh_memory, observe
from baselines.staged import LawStage
from birthsim_env.loop.rows import (
    ASKED,
    DAMPING,
    FEEDFORWARD,
    HANDED,
    POSITION,
    POSITION_TIME,
    PRESSURE,
    REFERENCE,
    SEEN,
    TIME,
    USER_FORCE,
    VELOCITY,
)
from birthsim_env.loop.stage import block, numbers, scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, parameter_column
from birthsim_env.physics.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.parameters import Parameters

MOTION = HANDED
"""x and y (m) that the hand should find, and three derivatives."""
MOVING = MOTION + 8
"""1 where that motion is faster than ``MOVING_SPEED``, else 0."""
JOINTS = MOVING + 1
"""y1, y2 (m), v1, v2 (m/s), measured or estimated."""
OWN = JOINTS + 4
"""Rows from here on are for the laws themselves to name."""

MASS, RATIO, PERIOD, COMPLIANT = range(4)
"""Constants of the compliant motion: mass, kg; damping ratio; control period, s. ``COMPLIANT`` is their number."""


@kernel
def _comply(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes ``MOTION`` and ``MOVING``; returns how many stiffness setpoints are not positive definite."""
    s, about, missed = block(seen, SEEN), numbers(constants, COMPLIANT), 0
    target, motion = s[ASKED:FEEDFORWARD, :n], s[MOTION:MOVING, :n]
    for i in range(n):
        missed += 0 if is_stiffer(target[8, i], target[9, i], target[14, i], 0.0) else 1
    give_way(
        block(memory, 4)[:, :n], target, s[USER_FORCE:REFERENCE, :n], about[MASS], about[RATIO], about[PERIOD], s[DAMPING, :n],
        motion,
    )  # fmt: skip
    mark_moving(motion, s[MOVING, :n])
    return missed


def compliant_motion(rig: Parameters) -> LawStage:
    """Turns the measured force into ``MOTION``; its memory is what ``give_way`` calls the offset."""
    return LawStage(_comply, np.array([rig.mechanics.mass, DAMPING_RATIO, rig.electronics.control_period]), np.zeros(4))


ROWS, TICK, NOISE, INFORMED, RIG = range(5)
"""Constants of the pistons' stage: rows of the observer's memory, or 0 where speeds are measured; control period, s; position
noise, m; 1 where the observer is told the user's force and ``MOVING``. The rig follows."""


@kernel
def _locate(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes ``JOINTS``."""
    s, about = block(seen, SEEN), numbers(constants, RIG + PARAMETERS)
    p, rows = about[RIG:], int(about[ROWS])
    if rows == 0:
        piston_motion(s[POSITION:POSITION_TIME], p, s[JOINTS:OWN], n)
        return 0
    nothing, m = scratch(4)[:, :n], block(memory, rows)[:, :n]
    for i in range(n):
        nothing[0, i], nothing[1, i], nothing[2, i], nothing[3, i] = 0.0, 0.0, 1.0, about[NOISE]
    informed = about[INFORMED] > 0.0
    observe(
        m, s[TIME, :n], s[POSITION:VELOCITY, :n], s[POSITION_TIME, :n], s[VELOCITY:POSITION_TIME, :n],
        s[PRESSURE:USER_FORCE, :n], p, about[TICK], BANDWIDTH, nothing[3],
        s[USER_FORCE:REFERENCE, :n] if informed else nothing[:2], nothing[:2], s[MOVING, :n] if informed else nothing[2],
    )  # fmt: skip
    for row in range(4):
        for i in range(n):
            s[JOINTS + row, i] = m[ESTIMATE + row, i]
    return 0


def pistons(rig: Parameters, sampled: bool, informed: bool) -> LawStage:
    """Finds ``JOINTS``, with an observer where positions are samples.

    Where it is ``informed`` it knows the user's force, and lets pistons rest while ``MOVING`` says that nothing moves.
    """
    board, fresh = rig.electronics, fresh_memory(rig) if sampled else np.zeros(0)
    about = (len(fresh), board.control_period, board.position_noise, informed)
    return LawStage(_locate, np.array([*about, *parameter_column(rig)]), fresh)
