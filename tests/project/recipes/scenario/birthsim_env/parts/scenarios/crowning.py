"""Crowning: the head comes forward and is held back."""

import math

from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.references import Path
from birthsim_env.parts.scenarios import Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register


@register(scenario="crowning", about="The head comes forward slowly, and a hand holds it back twice.")
class Crowning(Scenario):
    """The head comes 30 mm in 8 s, and is held back with 60 N twice."""

    title = "Crowning"
    duration = 10.0

    def nominal(self) -> Parts:
        # All values are assumed.
        reference = Path((0.45, 0.0), 0.0, 0.03, begins=1.0, ends=9.0)
        return reference, Pulls((60.0, 60.0), rate=100.0, angle=math.pi), StiffnessSchedule()

    def varied(self) -> Parts:
        reference = Path(((0.44, 0.46), (-0.02, 0.02)), 0.0, (0.02, 0.04), begins=1.0, ends=9.0)
        return reference, Pulls(((40.0, 80.0),) * 2, rate=100.0, angle=math.pi), StiffnessSchedule()
