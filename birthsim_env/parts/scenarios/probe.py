"""The stiffness test."""

from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.references import FixedTarget
from birthsim_env.parts.scenarios import MEASURED_RIG, Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register

REST = 3.0
"""s before the push: with honest sensors the best law takes that long to bring the head to rest (docs/laboratory/worst.md)."""


@register(scenario="probe", about="The head stands still and gives way to whoever pulls it.", order=2)
class Probe(Scenario):
    """Hold still and, after 3 s, be pushed: the stiffness test."""

    title = "Stiffness test: hold and be pushed"
    duration = 7.0
    version = 3
    changed = MEASURED_RIG
    studied = True

    def nominal(self) -> Parts:
        return FixedTarget(), Ramp(begins=REST), StiffnessSchedule()

    def varied(self) -> Parts:
        reference = FixedTarget(((0.4, 0.6), (-0.1, 0.06)))
        stiffness = StiffnessSchedule((0.0,), ((1000.0, 4000.0),), ((3000.0, 4800.0),), ((1500.0, 2400.0),))
        return reference, Ramp(amplitude=(5.0, 40.0), angle="axes", begins=REST), stiffness
