"""``admittance-backstepping`` as a stage of the closed loop: what is known of the rig, then the law of ``admittance.law``."""

from __future__ import annotations

from baselines.admittance import law as admittance_law
from baselines.estimation import chamber_observer, disturbance_observer, reference_friction
from baselines.estimation.observers import REST, observe
from baselines.estimation.stages import MOTION, MOVING
from baselines.estimation.state_estimator import disturbance_forces
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

BRISTLES, CHAMBERS, JOINTS, LAW = 0, 2, 15, 19
PISTONS = LAW + admittance_law.MEMORY
"""Rows of memory at which its parts begin: bristles (2); spools (4), pressures (4), openings (4) and 1 at a new start; joints a
period ago (4); the law's own; the observer of the pistons."""

MEASURED_ROWS = 5
"""Rows of that observer where speeds are measured; the last is 1 at a new start."""

CONSTANTS = (
    *("sampled", "rows", "period", "friction_fraction", "trust", "bandwidth", "noise"),
    *admittance_law.GAIN_NAMES,
)
"""Constants of the stage: 1 with sampled positions; rows of the observer of the pistons; control period, s; fraction of
friction fed forward; trust in a pressure cell, 0 to 1; bandwidth, 1/s, of the observer; position noise, m; and the gains of the
law. The rig follows."""
SAMPLED, ROWS, PERIOD, FRICTION, TRUST, BANDWIDTH, NOISE, GAINS = range(8)
NUMBERS = len(CONSTANTS)


@kernel
def control(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """One control period of a block, along ``stages.MOTION``."""
    s, about = block(seen, SEEN), numbers(constants, NUMBERS + PARAMETERS)
    p, period, sampled = about[NUMBERS:], about[PERIOD], about[SAMPLED] > 0.0
    m = block(memory, PISTONS + int(about[ROWS]))[:, :n]
    own = scratch(8)[:, :n]
    believed, disturbance, disturbance_force, rest = own[:2], own[2:4], own[4:6], own[6:]
    motion, moving, force = s[MOTION:MOVING, :n], s[MOVING, :n], s[USER_FORCE:REFERENCE, :n]
    target, told = s[ASKED:FEEDFORWARD, :n], s[FEEDFORWARD:ACTION, :n]
    spools, pressures, opened = m[CHAMBERS : CHAMBERS + 4], m[CHAMBERS + 4 : CHAMBERS + 8], m[CHAMBERS + 8 : CHAMBERS + 12]
    joints, measured = m[JOINTS : JOINTS + 4], s[PRESSURE:USER_FORCE, :n]
    chamber_observer.observe(spools, pressures, opened, measured, joints, p, period, about[TRUST], m[CHAMBERS + 12])
    reference_friction.rub(motion, p, period, m[BRISTLES : BRISTLES + 2], believed)
    for i in range(n):
        for k in range(2):
            believed[k, i], rest[k, i] = -about[FRICTION] * believed[k, i], 0.0
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
        m[CHAMBERS + 12, i] = 0.0
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
    return 0
