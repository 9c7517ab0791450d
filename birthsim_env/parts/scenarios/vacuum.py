"""Vacuum extraction."""

import math

from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.hands.vacuum import VacuumPulls
from birthsim_env.parts.references import Path
from birthsim_env.parts.scenarios import MEASURED_RIG, Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register


@register(scenario="vacuum", about="A vacuum cup pulls three times, up to 241 N, while the head comes forward.", order=6)
class Vacuum(Scenario):
    """The head comes 40 mm, vacuum tractions of 176, 225 and 241 N."""

    title = "Vacuum extraction"
    duration = 24.0
    version = 1
    changed = MEASURED_RIG
    studied = True

    def nominal(self) -> Parts:
        # Medians of the peak force of easy, average and hard extractions (Pettersson et al., BJOG 122:1809, 2015, 200 women).
        # 241 N is 98 % of what cylinder 2 can bear. Compressed in time: a pull lasts as long as a contraction, here 2 s.
        # Pettersson et al., PLOS ONE 12(3):e0171938 (2017), sum force over time as well, over 277 extractions; 2 s cannot
        # render such sums.
        reference = Path((0.43, 0.0), 0.0, 0.04, begins=1.0, ends=22.0)
        stiffness = StiffnessSchedule((0.0,), (4000.0,), (4200.0,), (2000.0,))
        return reference, Pulls((176.0, 225.0, 241.0), rate=70.0), stiffness

    def varied(self) -> Parts:
        reference = Path(((0.42, 0.44), (-0.03, 0.03)), 0.0, (0.03, 0.05), begins=1.0, ends=22.0)
        stiffness = StiffnessSchedule((0.0,), (4000.0,), ((3800.0, 4400.0),), ((1800.0, 2200.0),))
        angle = math.radians(-10), math.radians(10)
        return reference, VacuumPulls(((0.0, 1.0),) * 3, rate=(60.0, 100.0), angle=angle), stiffness
