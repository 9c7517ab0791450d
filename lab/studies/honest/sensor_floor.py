"""What the errors of ``honest`` sensors leave to the best law: one that puts the place shown where the force shown asks for it.

Scale and distortion of the tracker, gain and crosstalk of the force sensor are not observable by a law: no other sensor of the
rig tells position to a millimetre, or a hand's force from friction. Noise, delays and converters, which time averages, are
switched off, and so is the bias of the force, which a law may tare.
"""

from copy import deepcopy
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from baselines.estimation.admittance import DAMPING_RATIO
from baselines.impedance import DeclaredMotion, mass_spring_damper
from birthsim_env.loop.signals import displacement
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.hands.user_forces import forces_of
from birthsim_env.parts.sensors.honest import HonestSensors
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.reward import SETTLED

STATIC = ("force_gain_error", "force_crosstalk", "position_distortion", "distortion_length", "position_scale_error")
"""Errors that do not change in an episode and that no law can find."""

HELD = 5.0
"""s into ``BirthSIM/Probe-v3`` when the push is held."""

STEP = 0.02
"""s between the instants of a circle that are looked at."""

STEPS = 12
"""Iterations for the place: each is nearer by the slope of the distortion, below 0.1."""


def probe_floor(rig: Parameters, episodes: int, seed: int) -> dict[str, Array]:
    """Of the worlds of ``BirthSIM/Probe-v3`` for ``rig``: ``stiffness_error``, %, and ``held_error``, mm, the distance from
    the compliant target while the push is held; (episodes,) each."""
    env: Any = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=episodes, parameters=rig, sensors="honest", randomize=True)
    _, info = env.reset(seed=[seed + k for k in range(episodes)])
    target, stiffness = info["target"].T, info["stiffness_setpoint"].T
    env.simulation.run(round(HELD / env.simulation.period))
    force = env.simulation.force.copy()
    env.close()
    static = _static_sensors(rig, episodes, seed)

    def place(pushed: Array) -> Array:
        return _place(static, target + _spring(_felt(static, pushed), stiffness))

    moved, wanted = place(force) - place(np.zeros_like(force)), _spring(force, stiffness)
    direction = force / np.hypot(*force)
    along, asked = (np.einsum("in,in->n", way, direction) for way in (moved, wanted))
    return {
        "stiffness_error": 100 * (asked / along - 1), "held_error": 1e3 * np.hypot(*(place(force) - target - wanted))
    }  # fmt: skip


def circle_floor(rig: Parameters, episodes: int, seed: int) -> Array:
    """Settled error of the worlds of ``BirthSIM/Circle-v2`` for ``rig``, mm, (episodes,)."""
    env: Any = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=episodes, parameters=rig, sensors="honest", randomize=True)
    env.reset(seed=[seed + k for k in range(episodes)])
    simulation, static = env.simulation, _static_sensors(rig, episodes, seed)
    hand, before = deepcopy(simulation.user_force), np.zeros((2, episodes))
    jumped, squares, counts = np.zeros((3, episodes))
    for instant in np.arange(0.0, env.steps * simulation.period * simulation.periods, STEP):
        reference = simulation.reference_at(np.full(episodes, instant))
        force = forces_of(hand, np.full((1, episodes), instant), reference.position, reference.velocity)[0].copy()
        jumped[np.any(force != before, axis=0)] = instant
        before, settled = force, instant - jumped >= SETTLED
        asked = reference.position + _spring(_felt(static, force), reference.stiffness)
        missed = _place(static, asked) - reference.compliant_target(force)
        squares += settled * (missed**2).sum(axis=0)
        counts += settled
    env.close()
    return np.asarray(1e3 * np.sqrt(squares / counts))


def motion_floor(env: Any, rig: Parameters, seed: int) -> Array:
    """RMS, mm, (N,), from ``SETTLED`` s on, of how far a place shown is wrong that follows the impedance of ``admittance``.

    The impedance moves under the force shown; the error compares with its motion under the true force. ``env`` is a residual
    vector environment for ``rig`` with ``honest`` sensors, whose controller, under actions of zero, the hand holds.
    """
    lanes, still = env.num_envs, np.zeros(env.action_space.shape, np.float32)
    env.reset(seed=seed)
    simulation, static = env.simulation, _static_sensors(rig, lanes, seed)
    period, reference, force = simulation.period * simulation.periods, simulation.reference, simulation.force.copy()
    true, shown, squares, counts = DeclaredMotion(lanes), DeclaredMotion(lanes), np.zeros(lanes), 0
    # Where an episode has ended the next has begun.
    for step in range(env.steps - 1):
        impedance, before = mass_spring_damper(reference, simulation.parameters.mechanics.mass, DAMPING_RATIO), force
        env.step(still)
        reference, force = simulation.reference, simulation.force.copy()
        true.advance(impedance, before, force, period)
        shown.advance(impedance, _felt(static, before), _felt(static, force), period)
        if step * period >= SETTLED:
            missed = _place(static, reference.position + shown.offset[:2]) - reference.position - true.offset[:2]
            squares, counts = squares + (missed**2).sum(axis=0), counts + 1
    return np.asarray(1e3 * np.sqrt(squares / counts))


def _place(static: HonestSensors, asked: Array) -> Array:
    """The place (2, N), m, that is shown as ``asked`` (2, N)."""
    found, none = asked, np.zeros_like(asked)
    for _ in range(STEPS):
        found = found - (_shown(static, found, none)[0] - asked)
    return found


def _felt(static: HonestSensors, force: Array) -> Array:
    """What a force (2, N), N, is shown as."""
    return _shown(static, np.zeros_like(force), force)[1].copy()


def _spring(force: Array, stiffness: Array) -> Array:
    """Displacement (2, N), m, of springs (2, N), N/m, along x and y under a force (2, N), N."""
    x, y = displacement(force[0], force[1], stiffness[0], stiffness[1], 0.0)
    return np.stack([x, y])


def static_only(rig: Parameters) -> Parameters:
    """``rig`` whose sensors have no errors but ``STATIC``, which are drawn as those of ``rig``."""
    others = {f"electronics.{name}": 0.0 for name in SENSOR_PARAMETERS if name not in STATIC}
    ranges = rig.own_ranges | {name: (0.0, 0.0) for name in others}
    return replace(rig.replace(others), ranges=tuple((name, *pair) for name, pair in ranges.items()))


def _static_sensors(rig: Parameters, episodes: int, seed: int) -> HonestSensors:
    """The sensors of these worlds with nothing but ``STATIC``."""
    still = static_only(rig)
    sensors, drawn = HonestSensors(still.electronics, episodes), documented_ranges(still, "honest")
    # A figure that is switched off still takes its number from the stream.
    sensors.vary({name: pair for name, pair in drawn.items() if name in HonestSensors.drawn})
    for lane in range(episodes):
        sensors.begin(lane, stream(seed + lane, 0, "sensors"))
    return sensors


def _shown(sensors: HonestSensors, position: Array, force: Array) -> tuple[Array, Array]:
    """Position and force, (2, N), as they are shown at rest at ``position`` (2, N), m, under ``force`` (2, N), N."""
    lanes = position.shape[1]
    motion = np.concatenate([position, np.zeros((2, lanes))])
    seen = sensors.measure(np.zeros(lanes, dtype=np.int64), np.zeros(lanes), motion, np.zeros((4, lanes)), force)
    return seen.position, seen.user_force
