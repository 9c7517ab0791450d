"""``admittance-backstepping`` that learns what it is not told: friction, the tracker's noise, the bias of the force sensor."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from baselines.admittance import adaptive_stage as at
from baselines.admittance import law as admittance_law
from baselines.admittance.controller import LEAST_FRACTION, AdmittanceBackstepping
from baselines.admittance.stage import MEASURED_ROWS
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.estimation import inertial
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.estimation.observers import FRESH, memory_rows
from baselines.staged import LawStage
from birthsim_env.loop.rows import HANDED, POSITION
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.lanes import Array

SAMPLED_LEAST, MOST_FALLS = 0.5, 3.0
"""With sampled positions and a force sensor: the least fraction of the gain, and how many times a large half wave lowers it at
once. A late tracker makes light rigs swing at 10 Hz until the gain has fallen; with less gain than this a noisy one makes them
swing at 1 Hz. Found by trial, in worlds with drawn sensors; without a force sensor friction then hunts more."""

MOST_BIAS = 2.0
"""assumed: a force sensor's bias is at most so many times that believed."""


class AdaptiveAdmittance(AdmittanceBackstepping):
    """As ``AdmittanceBackstepping``, adaptive: ``friction_level``, ``tracker_noise`` and ``force_bias`` of ``estimation``.

    Where the rig as believed has an acceleration sensor and positions are samples, ``estimation.inertial`` tells the motion.

    Arguments are those of ``AdmittanceBackstepping``. One gain more: friction_rate, 1/s, at which friction is learned while
    a piston slides; 0 learns nothing.
    """

    FORCE_SENSOR: ClassVar[bool] = True
    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {**AdmittanceBackstepping.TUNABLE, "friction_rate": (0.0, 20.0)}
    TUNED: ClassVar[dict[str, dict[str, float]]] = {
        "ideal": {**AdmittanceBackstepping.TUNED["ideal"], "friction_rate": 4.0},
        "lab": {**AdmittanceBackstepping.TUNED["lab"], "friction_rate": 4.0, "rest_gain": 45.0},
        "inertial": {
            **AdmittanceBackstepping.TUNED["ideal"],
            **{"friction_rate": 4.0, "rest_gain": 45.0, "pressure_bandwidth": 30.0},
        },
    }

    @property
    def gain_fraction(self) -> Array:
        return self._memories[-1][[at.LAW + row for row in admittance_law.GAIN_SHARES]]

    def law_stages(self, sampled: bool) -> list[LawStage]:
        rig = self.parameters
        board = rig.electronics
        feels = sampled and self.FORCE_SENSOR and board.acceleration_bandwidth > 0
        noisy, sampled = sampled, sampled and not feels
        g = self._gains["inertial" if feels else "lab" if sampled else "ideal"]
        period, rows = board.control_period, memory_rows(rig) if sampled else MEASURED_ROWS
        yields = sampled and self.FORCE_SENSOR
        cells = exact.number("exp", -(g["pressure_bandwidth"] if noisy else math.inf) * period)
        constants = {
            **{"sampled": sampled, "rows": rows, "period": period, "mass": rig.mechanics.mass, "ratio": DAMPING_RATIO},
            **{"trust": 1.0 - cells, "noise": board.position_noise, "pneumatic_gain": PNEUMATIC_GAIN},
            **{"quickness": 1.0 - exact.number("exp", -period / g["lead_time"]), **g},
            **{"least_fraction": SAMPLED_LEAST if yields else LEAST_FRACTION, "most_falls": MOST_FALLS if yields else 1.0},
            **{"force_bias": MOST_BIAS * board.force_bias if noisy and self.FORCE_SENSOR else 0.0},
            **{"force_sensor": self.FORCE_SENSOR, "place": HANDED if feels else POSITION},
        }
        fresh = np.zeros(at.PISTONS + rows)
        fresh[[at.FRESH, at.PISTONS + (FRESH if sampled else 4)]] = 1.0
        fresh[[at.LAW + row for row in admittance_law.GAIN_SHARES]] = 1.0
        law = LawStage(at.control, np.array([*(constants[name] for name in at.CONSTANTS), *self._p]), fresh)
        return [inertial.law_stage(rig), law] if feels else [law]


class SensorlessAdmittance(AdaptiveAdmittance):
    """``AdaptiveAdmittance`` without a force sensor: ``estimation.force_observer`` tells the hand's force.

    It never reads ``Measurement.user_force``. Friction is not learned, since nothing tells it from the hand.
    """

    FORCE_SENSOR = False
