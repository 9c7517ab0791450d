"""``admittance-backstepping`` as a stage of the closed loop: what is known of the rig, then the law of ``admittance.law``."""

from __future__ import annotations

from baselines.admittance import law as admittance_law
from baselines.estimation import admittance, chamber_observer, disturbance_observer, reference_friction
from baselines.estimation.observers import REST, observe
from baselines.estimation.state_estimator import MOVING_SPEED, disturbance_forces
from birthsim_env.loop.rows import (
    ACTION,
    ASKED,
    FEEDFORWARD,
    OPENING,
    POSITION,
    POSITION_TIME,
    PRESSURE,
    REFERENCE,
    SEEN,
    SHOWN,
    TIME,
    USER_FORCE,
    VELOCITY,
)
from birthsim_env.loop.stage import block, numbers, scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS

ADMITTANCE, BRISTLES, CHAMBERS, JOINTS, LAW = 0, 5, 7, 20, 24
PISTONS = LAW + admittance_law.MEMORY
"""Rows of memory at which its parts begin: offset of the compliant motion (4) and 1 at a new start; bristles (2); spools (4),
pressures (4), openings (4) and 1 at a new start; joints a period ago (4); the law's own; the observer of the pistons."""

MEASURED_ROWS = 5
"""Rows of that observer where speeds are measured; the last is 1 at a new start."""

CONSTANTS = (
    *("sampled", "rows", "period", "mass", "ratio", "friction_fraction", "trust", "bandwidth", "noise"),
    *admittance_law.GAIN_NAMES,
)
"""Constants of the stage: 1 with sampled positions; rows of the observer of the pistons; control period, s; mass, kg, and
damping ratio of the admittance; fraction of friction fed forward; trust in a pressure cell, 0 to 1; bandwidth, 1/s, of the
observer; position noise, m; and the gains of the law. The rig follows."""
SAMPLED, ROWS, PERIOD, MASS, RATIO, FRICTION, TRUST, BANDWIDTH, NOISE, GAINS = range(10)
NUMBERS = len(CONSTANTS)


@kernel
def control(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are not positive definite."""
    s, about = block(seen, SEEN), numbers(constants, NUMBERS + PARAMETERS)
    p, period, sampled = about[NUMBERS:], about[PERIOD], about[SAMPLED] > 0.0
    m = block(memory, PISTONS + int(about[ROWS]))[:, :n]
    own = scratch(17)[:, :n]
    motion, believed, disturbance, disturbance_force = own[:8], own[8:10], own[10:12], own[12:14]
    rest, moving, force, missed = own[14:16], own[16], s[USER_FORCE:REFERENCE, :n], 0
    target, told = s[ASKED:FEEDFORWARD, :n], s[FEEDFORWARD:ACTION, :n]
    for i in range(n):
        kx, ky, kxy = target[8, i], target[9, i], target[14, i]
        missed += 0 if kx > 0.0 and kx * ky - kxy * kxy > 0.0 else 1
        for k in range(2):
            rest[k, i] = 0.0
    admittance.give_way(
        m[ADMITTANCE : ADMITTANCE + 4], target, force, about[MASS], about[RATIO], period, told[4], m[ADMITTANCE + 4], motion
    )  # fmt: skip
    spools, pressures, opened = m[CHAMBERS : CHAMBERS + 4], m[CHAMBERS + 4 : CHAMBERS + 8], m[CHAMBERS + 8 : CHAMBERS + 12]
    joints, measured = m[JOINTS : JOINTS + 4], s[PRESSURE:USER_FORCE, :n]
    chamber_observer.observe(spools, pressures, opened, measured, joints, p, period, about[TRUST], m[CHAMBERS + 12])
    reference_friction.rub(motion, p, period, m[BRISTLES : BRISTLES + 2], believed)
    for i in range(n):
        moving[i] = 1.0 if motion[2, i] * motion[2, i] + motion[3, i] * motion[3, i] > MOVING_SPEED * MOVING_SPEED else 0.0
        for k in range(2):
            believed[k, i] = -about[FRICTION] * believed[k, i]
    pistons, position, velocity = m[PISTONS:], s[POSITION:VELOCITY, :n], s[VELOCITY:POSITION_TIME, :n]
    if sampled:
        observe(
            pistons, s[TIME, :n], position, s[POSITION_TIME, :n], velocity, pressures, p, period, about[BANDWIDTH],
            about[NOISE], force, believed, moving,
        )  # fmt: skip
    else:
        disturbance_observer.observe(
            pistons, position, velocity, pressures, force, believed, p, period, about[BANDWIDTH], pistons[4], joints
        )
    for i in range(n):
        m[ADMITTANCE + 4, i], m[CHAMBERS + 12, i] = 0.0, 0.0
        if sampled:
            for k in range(4):
                joints[k, i] = pistons[k, i]
            for k in range(2):
                disturbance[k, i], rest[k, i] = pistons[4 + k, i], pistons[REST + k, i]
        else:
            pistons[4, i] = 0.0
            for k in range(2):
                disturbance[k, i] = pistons[2 + k, i]
    disturbance_forces(joints, believed, disturbance, p, disturbance_force)
    openings = s[OPENING:SHOWN, :n]
    admittance_law.command(
        joints, pressures, motion, target, force, disturbance_force, rest, moving, spools, p, period, about[GAINS:NUMBERS],
        told, m[LAW : LAW + admittance_law.MEMORY], openings,
    )  # fmt: skip
    for valve in range(4):
        for i in range(n):
            opened[valve, i] = openings[valve, i]
    return missed
