"""What the errors of ``honest`` sensors leave to the best law: one that puts the place shown where the force shown asks for it.

Scale and distortion of the tracker, gain and crosstalk of the force sensor are not observable by a law: no other sensor of the
rig tells position to a millimetre, or a hand's force from friction. Noise, delays and converters, which time averages, are
switched off, and so is the bias of the force, which a law may tare.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from birthsim_env.loop.signals import displacement
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.sensors.honest_sensors import HonestSensors
from birthsim_env.parts.sensors.sensor_errors import FIGURES
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

STATIC = ("force_gain_error", "force_crosstalk", "position_distortion", "distortion_length", "position_scale_error")
"""Errors that do not change in an episode and that no law can find."""

HELD = 3.0
"""s into ``BirthSIM/Probe`` when the push is held."""

STEPS = 12
"""Iterations for the place: each is nearer by the slope of the distortion, below 0.1."""


def probe_floor(rig: Parameters, episodes: int, seed: int) -> dict[str, Array]:
    """Of the worlds of ``BirthSIM/Probe-v1`` for ``rig``: ``stiffness_error``, %, and ``held_error``, mm, the distance from
    the compliant target while the push is held; (episodes,) each."""
    env: Any = gymnasium.make_vec(
        "BirthSIM/Probe-v1", num_envs=episodes, policy_period=HELD, parameters=rig, sensors="honest", randomize=True
    )
    _, info = env.reset(seed=[seed + k for k in range(episodes)])
    target, stiffness = info["target"].T, info["stiffness_setpoint"].T
    info = env.step(np.zeros((episodes, env.single_action_space.shape[0]), dtype=np.float32))[4]
    force = info.get("final_info", info)["user_force"].T
    env.close()
    static = _static_sensors(rig, episodes, seed)

    def place(pushed: Array) -> Array:
        found: Array = target + _spring(pushed, stiffness)
        for _ in range(STEPS):
            shown, felt = _shown(static, found, pushed)
            found = found - (shown - target - _spring(felt, stiffness))
        return found

    moved, wanted = place(force) - place(np.zeros_like(force)), _spring(force, stiffness)
    direction = force / np.hypot(*force)
    along, asked = (np.einsum("in,in->n", way, direction) for way in (moved, wanted))
    return {
        "stiffness_error": 100 * (asked / along - 1), "held_error": 1e3 * np.hypot(*(place(force) - target - wanted))
    }  # fmt: skip


def _spring(force: Array, stiffness: Array) -> Array:
    """Displacement (2, N), m, of springs (2, N), N/m, along x and y under a force (2, N), N."""
    x, y = displacement(force[0], force[1], stiffness[0], stiffness[1], 0.0)
    return np.stack([x, y])


def _static_sensors(rig: Parameters, episodes: int, seed: int) -> HonestSensors:
    """The sensors of these worlds with nothing but ``STATIC``."""
    others = [name for name in FIGURES if name not in STATIC]
    sensors = HonestSensors(rig.replace({f"electronics.{name}": 0.0 for name in others}).electronics, episodes)
    drawn = {name: pair for name, pair in documented_ranges(rig, "honest").items() if name in HonestSensors.drawn}
    # A figure that is switched off still takes its number from the stream.
    sensors.vary({name: pair if name.rpartition(".")[2] in STATIC else (0.0, 0.0) for name, pair in drawn.items()})
    for lane in range(episodes):
        sensors.begin(lane, stream(seed + lane, 0, "sensors"))
    return sensors


def _shown(sensors: HonestSensors, position: Array, force: Array) -> tuple[Array, Array]:
    """Position and force, (2, N), as they are shown at rest at ``position`` (2, N), m, under ``force`` (2, N), N."""
    lanes = position.shape[1]
    motion = np.concatenate([position, np.zeros((2, lanes))])
    seen = sensors.measure(np.zeros(lanes, dtype=np.int64), np.zeros(lanes), motion, np.zeros((4, lanes)), force)
    return seen.position, seen.user_force
