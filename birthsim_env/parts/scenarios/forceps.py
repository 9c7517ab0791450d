"""Forceps traction."""

import math

from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.references import FixedTarget
from birthsim_env.parts.scenarios import MEASURED_RIG, Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register


@register(scenario="forceps", about="Two pulls of 175 N, as with forceps, at a head held with 4000 N/m.", order=4)
class Forceps(Scenario):
    """Tractions ramped at 70 N/s to 175 N, held, released."""

    title = "Forceps traction"
    duration = 15.0
    version = 2
    changed = MEASURED_RIG
    studied = True

    def nominal(self) -> Parts:
        # 30-45 lb, 133-200 N, are recommended (Leslie et al., Obstet Gynecol 105:377, 2005). Ramps of 45-100 N/s are assumed;
        # in simulated dystocia the steepest had 45 N/s, 2-249 (Crofts et al., AJOG 197:156, 2007). 4000 N/m is assumed.
        # Compressed in time: a traction lasts as long as a contraction, here 2 s.
        stiffness = StiffnessSchedule((0.0,), (4000.0,), (4200.0,), (2000.0,))
        return FixedTarget((0.45, 0.0)), Pulls((175.0, 175.0), rate=70.0, angle=math.radians(-10)), stiffness

    def varied(self) -> Parts:
        stiffness = StiffnessSchedule((0.0,), (4000.0,), ((3800.0, 4400.0),), ((1800.0, 2200.0),))
        angle = math.radians(-20), math.radians(20)
        pulls = Pulls(((150.0, 200.0), (150.0, 200.0)), rate=(45.0, 100.0), angle=angle)
        return FixedTarget(((0.43, 0.47), (-0.03, 0.03))), pulls, stiffness
