"""Named rows of what the stages of a closed loop share, in blocks (rows, BLOCK).

``World`` is the truth, for the plant and what acts on it; ``Seen`` is what a controller is handed. The rig's parameters and
state stand at the beginning of the world, in the order of ``physics.lanes``.
"""

from __future__ import annotations

from birthsim_env.loop.signals import REFERENCES, Measurement
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array

STATE = PARAMETERS
IMPACT = STATE + STATES
"""Fastest collision of each piston with an end stop in this policy step, m/s."""
MOTION = IMPACT + 2
"""True x, y (m), vx, vy (m/s) of the end effector, where hand and tracker are: of its handle where the structure bends."""
FORCE = MOTION + 4
"""The hand's force Fx, Fy, N."""
SINCE_JUMP = FORCE + 2
"""s since force or stiffness setpoint jumped."""
TICK = SINCE_JUMP + 1
"""Control periods since the episode began."""
WORLD = TICK + 1
"""Rows of the world."""

MOST_ACTIONS, MOST_SHOWN, MOST_HANDED = 64, 64, 32
"""Longest action, most that an actuation shows of its memory, and most rows that a law's stages hand on."""

TIME = 0
"""s since the episode began."""
POSITION = TIME + 1
"""Measured x, y of the end effector, m."""
VELOCITY = POSITION + 2
"""vx, vy as measured, m/s."""
POSITION_TIME = VELOCITY + 2
"""When the position was measured, s."""
ACCELERATION = POSITION_TIME + 1
"""Acceleration of the end effector as a sensor there feels it, m/s2; 0 without one."""
PRESSURE = ACCELERATION + 2
"""Measured pressures of chambers P1, N1, P2, N2, Pa."""
USER_FORCE = PRESSURE + 4
"""Measured force of the hand, N."""
REFERENCE = USER_FORCE + 2
"""What is asked for, in the order of ``signals.REFERENCE_NAMES``."""
ASKED = REFERENCE + REFERENCES
"""What a law is asked for: the reference, or what a residual has made of it."""
FEEDFORWARD = ASKED + REFERENCES
"""What a law is told besides: forces along cylinders 1 and 2 (N), their rates (N/s), a damping factor."""
DAMPING = FEEDFORWARD + 4
"""That damping factor."""
ACTION = FEEDFORWARD + 5
"""The policy's action."""
OPENING = ACTION + MOST_ACTIONS
"""Commanded openings of the valves of chambers P1, N1, P2, N2."""
SHOWN = OPENING + 4
"""What an actuation shows of its memory to a policy."""
HANDED = SHOWN + MOST_SHOWN
"""What the stages of a law hand on to the next ones within a control period; the law names its rows."""
SEEN = HANDED + MOST_HANDED
"""Rows of what is seen."""


def fill_measurement(rows: Array, measurement: Measurement) -> None:
    """Write a measurement over N lanes into the first rows of what is seen, (REFERENCE or more, N)."""
    rows[TIME], rows[POSITION_TIME] = measurement.time, measurement.position_time
    rows[POSITION:VELOCITY], rows[VELOCITY:POSITION_TIME] = measurement.position, measurement.velocity
    rows[PRESSURE:USER_FORCE], rows[USER_FORCE:REFERENCE] = measurement.pressures, measurement.user_force
    if measurement.acceleration is not None:
        rows[ACCELERATION:PRESSURE] = measurement.acceleration


def measurement_of(rows: Array, sampled: bool, feels: bool) -> Measurement:
    """The measurement in a copy of the first rows of what is seen, with an acceleration where a sensor ``feels`` it."""
    seen = rows[:REFERENCE].copy()
    return Measurement(
        seen[TIME], seen[POSITION:VELOCITY], seen[POSITION_TIME], seen[VELOCITY:POSITION_TIME], seen[PRESSURE:USER_FORCE],
        seen[USER_FORCE:], sampled, seen[ACCELERATION:PRESSURE] if feels else None,
    )  # fmt: skip
