"""Named rows of what the stages of a closed loop share, in blocks (rows, BLOCK).

``World`` is the truth, for the plant and what acts on it; ``Seen`` is what a controller is handed.
"""

from typing import Any

import numpy as np

from birthsim_env.loop.signals import Measurement, Point, Reference
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, PARAMETER_UNITS, STATE_NAMES, STATE_UNITS, Array
from birthsim_env.physics.compiled.records import Rows, part, row, rows
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.values import shown


class World(Rows):
    """The rig and what acts on it. Parameters and state are in the order of ``physics.lanes``."""

    rig = rows(" ".join(f"rig_{name}" for name in PARAMETER_NAMES), PARAMETER_UNITS, "parameter of the rig")
    state = rows(" ".join(STATE_NAMES), STATE_UNITS, "state of the plant")
    impact = rows("impact1 impact2", "m/s", "fastest collision with an end stop in this policy step; zero begins anew")
    motion = part(Point, "end effector (its handle, if it bends), true", "")
    force = rows("force_x force_y", "N", "force of the hand, true")
    since_jump = row("s", "since force or stiffness setpoint jumped")
    tick = row("1", "control periods since the episode began")
    at_valve = rows("valve_P1 valve_N1 valve_P2 valve_N2", "Pa", "of a chamber's tube, at the valve's end; without, none")


class Feedforward(Rows):
    """What a law may be given besides: what it is to believe acts along cylinders 1 and 2."""

    force = rows("force1 force2", "N", "force along a cylinder")
    rate = rows("rate1 rate2", "N/s", "rate of that force")


MOST_ACTIONS, MOST_SHOWN, MOST_INTERMEDIATE = 64, 64, 32
"""Longest action, most that an actuation shows of its memory, and most rows that a law's stages hand on."""


class Signals(Rows):
    """What is measured and asked for."""

    time = row("s", "since the episode began")
    position = rows("measured_x measured_y", "m", "of the end effector, measured")
    velocity = rows("measured_vx measured_vy", "m/s", "of the end effector, measured")
    position_time = row("s", "when the position was measured")
    acceleration = rows("measured_ax measured_ay", "m/s2", "of the end effector as a sensor there measures it; 0 without one")
    pressure = rows("measured_Pp1 measured_Pn1 measured_Pp2 measured_Pn2", "Pa", "of the chambers, measured, absolute")
    user_force = rows("measured_force_x measured_force_y", "N", "of the hand, measured")
    reference = part(Reference, "what is asked for")


class Seen(Signals):
    """What a controller is handed."""

    asked = part(Reference, "what a law is asked for: the reference, or what a residual has made of it")
    feedforward = part(Feedforward, "what a law is to believe acts on the pistons")
    damping_factor = row("1", "damping in units of the least, where the law has one to vary; 0: the law's own")
    action = rows(MOST_ACTIONS, "1", "the policy's action")
    opening = rows("opening_P1 opening_N1 opening_P2 opening_N2", "1", "commanded opening of a valve, -1 to 1")
    shown = rows(MOST_SHOWN, "1", "what an actuation shows a policy of its memory")
    intermediate = rows(
        MOST_INTERMEDIATE, "SI", "what stages of a law hand on to the next ones in a period; the law names its rows"
    )
    missed = row("1", "control periods in which a signal that the controller reads was replaced by the last good one")
    fault = row("1", "0: none; 1: no good signal yet, valves closed; 2: the control has ended, see ``loop.guard``")


STATE, IMPACT, MOTION, FORCE = (one.first for one in (World.state, World.impact, World.motion, World.force))
SINCE_JUMP, TICK, AT_VALVE, WORLD = World.since_jump.first, World.tick.first, World.at_valve.first, World.size
TIME, POSITION, ACCELERATION, PRESSURE = (one.first for one in (Seen.time, Seen.position, Seen.acceleration, Seen.pressure))
REFERENCE = Seen.reference.first
ASKED, FEEDFORWARD, DAMPING, ACTION = (one.first for one in (Seen.asked, Seen.feedforward, Seen.damping_factor, Seen.action))
OPENING, SHOWN, INTERMEDIATE, FAULT, SEEN = (
    *(one.first for one in (Seen.opening, Seen.shown, Seen.intermediate, Seen.missed)),
    Seen.size,
)
"""Numbers of rows, for arrays that a loop places."""


def signal_of(name: str, value: Any) -> Array:
    """A signal, or what a controller is given besides, as float64; ``ValueError`` that names it for anything but numbers."""
    try:
        return floats_of(value)
    except ValueError as error:
        raise ValueError(f"{name} = {shown(value)}: {error}; allowed: an array of numbers") from error


_FLOAT = np.dtype(np.float64)

_PLACES: dict[str, int | slice] = {
    "time": Signals.time.first, "position": Signals.position.place, "velocity": Signals.velocity.place,
    "position_time": Signals.position_time.first, "pressures": Signals.pressure.place, "user_force": Signals.user_force.place,
    "acceleration": Signals.acceleration.place,
}  # fmt: skip
"""Field of a ``Measurement`` -> its row, or rows."""


def fill_measurement(rows: Array, measurement: Measurement) -> None:
    """Write a measurement over N lanes into the rows of ``Signals``; ``ValueError`` for what are no numbers, by name."""
    for name, place in _PLACES.items():
        value = getattr(measurement, name)
        if value is None and name == "acceleration":
            continue
        if type(value) is not np.ndarray or value.dtype is not _FLOAT:
            value = signal_of(f"measurement.{name}", value)
        own = rows[place]
        if value.shape != own.shape and value.ndim:
            raise ValueError(f"measurement.{name} has shape {value.shape}; allowed: {own.shape}")
        own[:] = value


def measurement_of(rows: Array, sampled: bool, has_acceleration: bool) -> Measurement:
    """The measurement in a copy of the rows of ``Signals``, with an acceleration where a sensor measures it."""
    seen = Signals(rows.copy())
    return Measurement(
        seen.time,
        seen.position,
        seen.position_time,
        seen.velocity,
        seen.pressure,
        seen.user_force,
        sampled,
        seen.acceleration if has_acceleration else None,
    )
