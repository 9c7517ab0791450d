"""The experiment of Fig. 4."""

from birthsim_env.parts.hands.steps import AlternatingSteps
from birthsim_env.parts.references import Circle
from birthsim_env.parts.scenarios import MEASURED_RIG, Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register


@register(scenario="circle", about="The head runs round a circle under pushes; after 8 s the stiffness doubles.", order=1)
class CircleUnderPushes(Scenario):
    """Fig. 4: a circle of 50 mm under pushes of 30 N, stiffness 2000 then 4000 N/m."""

    title = "Circle under pushes (Fig. 4)"
    duration = 16.0
    version = 2
    changed = MEASURED_RIG
    studied = True

    def nominal(self) -> Parts:
        # The stiffness doubles while the pneumatic stiffness falls. 2000 and 4000 N/m are the paper's.
        stiffness = StiffnessSchedule((0.0, 8.0), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0))
        return Circle(), AlternatingSteps(), stiffness

    def varied(self) -> Parts:
        setpoints = (1000.0, 5000.0)
        stiffness = StiffnessSchedule((0.0, 8.0), (setpoints, setpoints), ((3000.0, 4800.0),) * 2, ((1500.0, 2400.0),) * 2)
        return Circle(radius=(0.03, 0.1), period=(3.0, 6.0)), AlternatingSteps(amplitude=(10.0, 40.0)), stiffness
