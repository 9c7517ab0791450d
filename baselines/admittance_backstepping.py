"""Admittance outside, stiff backstepping inside, with disturbance observer, valve lead and gains that yield to oscillation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines import admittance_law
from baselines.admittance import Admittance
from baselines.backstepping import PNEUMATIC_GAIN
from baselines.controller import lanes_of
from baselines.disturbance_observer import DisturbanceObserver
from baselines.observers import PistonObserver
from baselines.reference_friction import ReferenceFriction
from birthsim_env.lanes import Array, parameter_column
from birthsim_env.parameters import Parameters, load_parameters
from birthsim_env.signals import Mask, Measurement, Reference, one_lane

MOVING_SPEED = 1e-3
"""m/s; assumed: a slower reference lets the pistons rest."""

LEAST_SHARE = 0.35
"""Of the gain, however long the loop oscillates: below it friction wins."""


class AdmittanceBackstepping:
    """Renders any stiffness matrix through friction, given a force sensor.

    A Cartesian ``Admittance`` turns the measured force into the motion that the hand should find, and ``admittance_law``
    follows it stiffly. What is not known, friction above all, is fed forward along the reference and observed for the rest,
    by ``DisturbanceObserver`` where speeds are measured and by ``PistonObserver`` from sampled positions.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``TUNABLE``, SI units; what is not given is the value of ``TUNED`` for the sensors that it meets:
            gain, c in 1/s while the reference moves, and rest_gain once it rests; bandwidth, 1/s, of the observer;
            friction_share, how much of the believed friction is fed forward along the reference; dead_zone, m, of a resting
            piston's error; lead_time, s, in which a spool follows; oscillation, m/s, of the speed error above which sustained
            half waves each lower the gain to yielding times itself.

    ``gain_share`` (N,) says how much of the gain is left. Raises ``ValueError`` for unknown gains and values out of range.
    """

    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {
        "gain": (30.0, 100.0),
        "rest_gain": (25.0, 100.0),
        "bandwidth": (30.0, 120.0),
        "friction_share": (0.0, 1.0),
        "dead_zone": (0.0, 5e-5),
        "lead_time": (5e-4, 5e-3),
        "oscillation": (0.02, 0.2),
        "yielding": (0.8, 1.0),
    }
    TUNED: ClassVar[dict[str, dict[str, float]]] = {
        "ideal": {
            "gain": 80.0,
            "rest_gain": 80.0,
            "bandwidth": 60.0,
            "friction_share": 1.0,
            "dead_zone": 0.0,
            "lead_time": 0.0015,
            "oscillation": 0.06,
            "yielding": 0.9,
        },
        "lab": {
            "gain": 60.0,
            "rest_gain": 39.0,
            "bandwidth": 72.0,
            "friction_share": 1.0,
            "dead_zone": 1e-5,
            "lead_time": 0.00125,
            "oscillation": 0.08,
            "yielding": 0.9,
        },
    }

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        for name, value in gains.items():
            if name not in self.TUNABLE:
                raise ValueError(f"{name} = {value!r} is no gain of {type(self).__name__}; allowed: {', '.join(self.TUNABLE)}")
            zero = self.TUNABLE[name][0] == 0
            if not (math.isfinite(value) and (value > 0 or (zero and value == 0))):
                raise ValueError(f"{name} = {value!r}; allowed: {'zero or a positive number' if zero else 'a positive number'}")
        if gains.get("yielding", 1.0) > 1:
            raise ValueError(f"yielding = {gains['yielding']!r}; allowed: at most 1, where oscillations cost no gain")
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._period = self.parameters.electronics.control_period
        self._gains: dict[str, dict[str, float]] = {kind: {**tuned, **gains} for kind, tuned in self.TUNED.items()}
        self._admittance = Admittance(self.parameters)
        self._friction = ReferenceFriction(self._period, self._p)
        self._by_speed = DisturbanceObserver(self._period, self._p, self._gains["ideal"]["bandwidth"])
        self._by_samples = PistonObserver(self.parameters, self._p, self._gains["lab"]["bandwidth"])
        self._memory: Array = np.empty((admittance_law.MEMORY, 0))

    @property
    def gain_share(self) -> Array:
        """What oscillations have left of the gain, (N,): 1 where there were none."""
        return np.asarray(self._memory[admittance_law.GAIN_SHARE])

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        for part in (self._admittance, self._friction, self._by_speed, self._by_samples):
            part.reset(lanes)
        if lanes is None:
            self._memory = np.empty((admittance_law.MEMORY, 0))
        elif self._memory.shape[1]:
            self._memory[:, lanes] = 0.0
            self._memory[admittance_law.GAIN_SHARE, lanes] = 1.0

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        Called once per control period. Raises ``ValueError`` for signals over different numbers of lanes, and for a stiffness
        setpoint that is not positive definite.
        """
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        lanes = lanes_of(measurement, reference)
        if self._memory.shape[1] != lanes:
            self._memory = np.zeros((admittance_law.MEMORY, lanes))
            self._memory[admittance_law.GAIN_SHARE] = 1.0
        force = np.ascontiguousarray(measurement.user_force)
        motion = self._admittance.update(measurement, reference)
        g = self._gains["lab" if measurement.sampled else "ideal"]
        believed = -g["friction_share"] * self._friction.update(motion)
        moving = (np.hypot(motion[2], motion[3]) > MOVING_SPEED).astype(np.float64)
        if measurement.sampled:
            joints = np.ascontiguousarray(self._by_samples.update(measurement, force, believed, moving))
            disturbance, rest = np.ascontiguousarray(self._by_samples.disturbance), self._by_samples.rest
        else:
            joints = self._by_speed.update(measurement, force, believed)
            disturbance, rest = np.ascontiguousarray(self._by_speed.disturbance), np.zeros((2, lanes))
        openings = np.empty((4, lanes))
        quickness = 1.0 - math.exp(-self._period / g["lead_time"])
        admittance_law.command(
            joints, measurement.pressures, motion, reference.rows, force, believed, disturbance, rest, moving, self._p,
            self._period, g["gain"], g["rest_gain"], g["dead_zone"], quickness, g["oscillation"], g["yielding"], LEAST_SHARE,
            PNEUMATIC_GAIN, self._memory, openings,
        )  # fmt: skip
        return openings
