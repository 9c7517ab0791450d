"""The descent of the head under contractions."""

import math

from birthsim_env.parts.hands.contractions import Contractions
from birthsim_env.parts.references import Path
from birthsim_env.parts.scenarios import MEASURED_RIG, Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register


@register(scenario="descent", about="The head descends through the birth canal while contractions push it.", order=3)
class Descent(Scenario):
    """Station -5 to +5 cm, then an arc of 70 mm through 80 degrees, contractions of 80 N."""

    title = "Fetal descent under contractions"
    duration = 24.0
    version = 2
    changed = MEASURED_RIG
    studied = True

    def nominal(self) -> Parts:
        # Station -5 to +5 cm is 100 mm of straight descent; the arc stands for the curve of Carus, its radius and angle are
        # assumed. Compressed in time: a contraction of 60 to 90 s lasts 12 s, and five pushes share its middle 6 s; at a birth
        # three or four of 10 s do.
        reference = Path((0.42, -0.04), 0.0, 0.10, 0.07, math.radians(80), begins=1.0, ends=23.0)
        stiffness = StiffnessSchedule((0.0, 8.0, 16.0), (2000.0, 4000.0, 3000.0), (4200.0,) * 3, (2100.0,) * 3)
        return reference, Contractions(pushes=(5, 5)), stiffness

    def varied(self) -> Parts:
        angle = math.radians(70), math.radians(90)
        reference = Path(((0.41, 0.43), (-0.05, -0.02)), 0.0, 0.10, (0.06, 0.08), angle, begins=1.0, ends=23.0)
        setpoints = (2000.0, 4000.0)
        stiffness = StiffnessSchedule((0.0, 8.0, 16.0), (setpoints,) * 3, ((3800.0, 4400.0),) * 3, ((1800.0, 2200.0),) * 3)
        return reference, Contractions(amplitude=(40.0, 125.0), push=(0.15, 0.35)), stiffness
