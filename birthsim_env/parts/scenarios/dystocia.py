"""Shoulder dystocia."""

import math

from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.references import Path
from birthsim_env.parts.scenarios import MEASURED_RIG, Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register


@register(scenario="dystocia", about="The head draws back and stiffens; three pulls follow, up to 163 N.", order=5)
class Dystocia(Scenario):
    """The head draws back 12 mm, stiffness 2000 to 4000 N/m, pulls of 84, 122 and 163 N."""

    title = "Dystocia: the head draws back and stiffens"
    duration = 16.0
    version = 2
    changed = MEASURED_RIG
    studied = True

    def nominal(self) -> Parts:
        # Clinicians pulled 84, 122 and 163 N in *simulated* routine, difficult and dystocia deliveries (Allen et al., AJOG
        # 171:1621, 1994, doi 10.1016/0002-9378(94)90413-8). At births the peaks were 47, 69 and 100 N (Allen, Sorab, Gonik,
        # Obstet Gynecol 77:352, 1991). A trainee pulls as in the simulation, so the scenario keeps those. The head draws back
        # at once.
        reference = Path((0.5, 0.0), math.pi, 0.012, begins=1.0, ends=1.5)
        stiffness = StiffnessSchedule((0.0, 1.0), (2000.0, 4000.0), (4200.0,) * 2, (2000.0,) * 2)
        return reference, Pulls((84.0, 122.0, 163.0), 100.0, math.radians(-5), begins=2.5, hold=1.5), stiffness

    def varied(self) -> Parts:
        reference = Path(((0.48, 0.52), (-0.03, 0.03)), math.pi, (0.010, 0.015), begins=1.0, ends=1.5)
        stiffness = StiffnessSchedule((0.0, 1.0), (2000.0, 4000.0), ((3800.0, 4400.0),) * 2, ((1800.0, 2200.0),) * 2)
        angle = math.radians(-15), math.radians(15)
        return reference, Pulls(((75.0, 163.0),) * 3, (80.0, 120.0), angle, begins=2.5, hold=1.5), stiffness
