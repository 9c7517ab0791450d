"""Admittance outside, stiff backstepping inside, with disturbance observer, valve lead and gains that yield to oscillation.

The gains are what these commands found (with lab, then with ideal), with gain and bandwidth a tenth lower: then the rig as
believed hunts less with lab sensors, and rigs of 1.5 kg with slow valves are stable with ideal ones, where oscillation was
halved as well.
    birthsim-tune --controller admittance-backstepping --trials 45 --seed 1 --sensors lab --start gains.json --out out/tune/lab
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.admittance import law as admittance_law
from baselines.admittance import stage as at
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.controller import check_gains, require_stiffness
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.estimation.observers import FRESH, memory_rows
from baselines.estimation.stages import compliant_motion
from baselines.impedance import Impedance, mass_spring_damper
from baselines.staged import LawStage, StagedController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

LEAST_FRACTION = 0.35
"""Lower bound of the gain reduction. With less gain friction holds the piston."""


class AdmittanceBackstepping(StagedController):
    """Renders any stiffness matrix through friction, given a force sensor.

    The stage turns the measured force into the motion that the hand should find. It estimates what is not known of the rig,
    friction above all. ``admittance_law`` follows the motion with a stiff loop.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``TUNABLE``, SI units. Where one is not given, ``TUNED`` has its value for the sensors in use.
            gain: c, 1/s, while the reference moves. rest_gain: c, 1/s, once it rests.
            rest_push: by how much the position error of a resting piston is multiplied.
            bandwidth: 1/s, of the observer of disturbances.
            pressure_bandwidth: 1/s, of the observer of pressures, where their cells are noisy (``lab`` sensors).
            friction_fraction: fraction of the believed friction that is fed forward along the reference.
            dead_zone: m, of a resting piston's error. lead_time: s, in which a spool follows.
            oscillation: m/s. Where the speed error swings beyond it, each sustained half wave multiplies the gain by yielding.

    ``gain_fraction`` (2, N) is the gain that is left across and along cylinder 2. Raises ``ValueError`` for unknown gains
    and values out of range.
    """

    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {
        "gain": (30.0, 100.0),
        "rest_gain": (25.0, 100.0),
        "rest_push": (1.0, 8.0),
        "bandwidth": (30.0, 120.0),
        "pressure_bandwidth": (30.0, 1000.0),
        "friction_fraction": (0.0, 1.0),
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
            "friction_fraction": 1.0,
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
            "friction_fraction": 0.943,
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
        super().__init__(parameters)
        self._gains: dict[str, dict[str, float]] = {kind: {**tuned, **gains} for kind, tuned in self.TUNED.items()}

    @property
    def gain_fraction(self) -> Array:
        """What oscillations across and along cylinder 2 have left of the gain, (2, N): 1 where there were none."""
        return self._memories[-1][[at.LAW + row for row in admittance_law.GAIN_SHARES]]

    def declared_impedance(self, reference: Reference) -> Impedance:
        """The mass, damper and spring of the admittance, over N lanes."""
        return mass_spring_damper(reference, self.parameters.mechanics.mass, DAMPING_RATIO)

    def law_stages(self, sampled: bool) -> list[LawStage]:
        g, rig = self._gains["lab" if sampled else "ideal"], self.parameters
        period, rows = rig.electronics.control_period, memory_rows(rig) if sampled else at.MEASURED_ROWS
        cells = exact.number("exp", -(g["pressure_bandwidth"] if sampled else math.inf) * period)
        constants = {
            **{"sampled": sampled, "rows": rows, "period": period},
            **{"trust": 1.0 - cells, "noise": rig.electronics.position_noise, "pneumatic_gain": PNEUMATIC_GAIN},
            **{
                "quickness": 1.0 - exact.number("exp", -period / g["lead_time"]),
                "least_fraction": LEAST_FRACTION,
                "most_falls": 1.0,
                **g,
            },
        }
        fresh = np.zeros(at.PISTONS + rows)
        fresh[[at.CHAMBERS + 12, at.PISTONS + (FRESH if sampled else 4)]] = 1.0
        fresh[[at.LAW + row for row in admittance_law.GAIN_SHARES]] = 1.0
        law = LawStage(at.control, np.array([*(constants[name] for name in at.CONSTANTS), *self._p]), fresh)
        return [compliant_motion(rig), law]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the error of the first lane whose stiffness is not positive definite."""
        require_stiffness(reference, 0.0)
