"""Admittance outside, stiff backstepping inside, with disturbance observer, valve lead and gains that yield to oscillation.

The gains are what these commands found (with lab, then with ideal), with gain and bandwidth a tenth lower: then the rig as
believed hunts less with lab sensors, and rigs of 1.5 kg with slow valves are stable with ideal ones, where oscillation was
halved as well.
    birthsim-tune --controller admittance-backstepping --trials 45 --seed 1 --sensors lab --start gains.json --out out/tune/lab
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.admittance import law as admittance_law
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.controller import check_gains, lanes_of, told_of
from baselines.estimation.awareness import Awareness
from birthsim_env.parts.signals import Mask, Measurement, Reference, one_lane
from birthsim_env.physics import exact
from birthsim_env.physics.lanes import Array, parameter_column
from birthsim_env.physics.parameters import Parameters, load_parameters

LEAST_SHARE = 0.35
"""Of the gain, however long the loop oscillates: below it friction wins."""

FRESH = np.zeros((admittance_law.MEMORY, 1))
"""What a lane remembers when it starts."""
FRESH[admittance_law.GAIN_SHARES] = 1.0


class AdmittanceBackstepping:
    """Renders any stiffness matrix through friction, given a force sensor.

    ``Awareness`` turns the measured force into the motion that the hand should find, and observes what is not known of the rig,
    friction above all; ``admittance_law`` follows that motion stiffly.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``TUNABLE``, SI units; what is not given is the value of ``TUNED`` for the sensors that it meets:
            gain, c in 1/s while the reference moves, and rest_gain once it rests; rest_push, how many times as much the
            position error of a resting piston weighs; bandwidth, 1/s, of the observer of disturbances;
            pressure_bandwidth, 1/s, of that of the pressures, where their cells are noisy (``lab`` sensors);
            friction_share, how much of the believed friction is fed forward along the reference; dead_zone, m, of a resting
            piston's error; lead_time, s, in which a spool follows; oscillation, m/s, of the speed error above which sustained
            half waves each lower the gain to yielding times itself.

    ``gain_share`` (2, N) says how much of the gain is left across and along cylinder 2. Raises ``ValueError`` for unknown gains
    and values out of range.
    """

    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {
        "gain": (30.0, 100.0),
        "rest_gain": (25.0, 100.0),
        "rest_push": (1.0, 8.0),
        "bandwidth": (30.0, 120.0),
        "pressure_bandwidth": (30.0, 1000.0),
        "friction_share": (0.0, 1.0),
        "dead_zone": (0.0, 5e-5),
        "lead_time": (5e-4, 5e-3),
        "oscillation": (0.02, 0.2),
        "yielding": (0.8, 1.0),
    }
    TUNED: ClassVar[dict[str, dict[str, float]]] = {
        "ideal": {
            "gain": 90.0,
            "rest_gain": 90.0,
            "rest_push": 1.0,
            "bandwidth": 108.0,
            "friction_share": 1.0,
            "dead_zone": 0.0,
            "lead_time": 0.0011,
            "oscillation": 0.1,
            "yielding": 0.94,
        },
        "lab": {
            "gain": 68.0,
            "rest_gain": 35.6,
            "rest_push": 2.0,
            "bandwidth": 110.0,
            "pressure_bandwidth": 30.0,
            "friction_share": 0.943,
            "dead_zone": 6.2e-6,
            "lead_time": 0.0005,
            "oscillation": 0.092,
            "yielding": 0.93,
        },
    }

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        check_gains(self, gains)
        if gains.get("yielding", 1.0) > 1:
            raise ValueError(f"yielding = {gains['yielding']!r}; allowed: at most 1, where oscillations cost no gain")
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._period = self.parameters.electronics.control_period
        self._gains: dict[str, dict[str, float]] = {kind: {**tuned, **gains} for kind, tuned in self.TUNED.items()}
        self._awareness = {kind: Awareness(self.parameters, kind == "lab", own) for kind, own in self._gains.items()}
        self._memory: Array = np.empty((admittance_law.MEMORY, 0))

    @property
    def gain_share(self) -> Array:
        """What oscillations across and along cylinder 2 have left of the gain, (2, N): 1 where there were none."""
        return np.asarray(self._memory[admittance_law.GAIN_SHARES])

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        for part in self._awareness.values():
            part.reset(lanes)
        if lanes is None:
            self._memory = np.empty((admittance_law.MEMORY, 0))
        elif self._memory.shape[1]:
            self._memory[:, lanes] = FRESH

    def command(
        self,
        measurement: Measurement,
        reference: Reference,
        believed_force: Array | None = None,
        believed_rate: Array | None = None,
        damping_factor: Array | None = None,
    ) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        Called once per control period. ``believed_force`` (2, N), N, along the cylinders, and its rate ``believed_rate``,
        N/s, are believed in beside what is observed. ``damping_factor`` (N,) multiplies the damping that the hand feels; below
        1 it is 1. Raises ``ValueError`` for signals over different numbers of lanes, and for a stiffness setpoint that is not
        positive definite.
        """
        if measurement.position.ndim == 1:
            given = (believed_force, believed_rate, damping_factor)
            told = (None if one is None else np.asarray(one, dtype=np.float64)[..., None] for one in given)
            return self.command(*one_lane(measurement, reference), *told)[:, 0]
        lanes = lanes_of(measurement, reference)
        believed = told_of(lanes, believed_force, believed_rate)
        if self._memory.shape[1] != lanes:
            self._memory = np.repeat(FRESH, lanes, axis=1)
        kind = "lab" if measurement.sampled else "ideal"
        g, awareness = self._gains[kind], self._awareness[kind]
        now = awareness.update(measurement, reference, damping_factor)
        openings = np.empty((4, lanes))
        quickness = 1.0 - exact.exp(-self._period / g["lead_time"])
        admittance_law.command(
            now.joints, now.pressures, now.motion, reference.rows, now.force, now.unseen, now.rest, now.moving,
            now.spools, self._p, self._period, g["gain"], g["rest_gain"], g["rest_push"], g["dead_zone"],
            quickness, g["oscillation"], g["yielding"], LEAST_SHARE, PNEUMATIC_GAIN, believed, self._memory, openings,
        )  # fmt: skip
        awareness.commanded(openings)
        return openings
