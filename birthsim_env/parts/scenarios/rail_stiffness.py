"""Steps of stiffness under a constant push on a rail, as variable stiffness actuators are measured."""

from birthsim_env.parts.drawn.seeding import Range
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.references import FixedTarget
from birthsim_env.parts.scenarios import Parts
from birthsim_env.parts.scenarios.rail import OnRail
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register

STARTS = (0.0, 5.0, 9.0, 13.0)
"""s of the stiffness setpoints; assumed: the push holds for 3 s before the first step."""


@register(scenario="rail-stiffness", about="One cylinder holds a push while its stiffness doubles twice and falls.", order=9)
class RailStiffness(OnRail):
    """One cylinder holds a constant push of 30 N while its stiffness steps from 1000 to 2000, 4000 and 2000 N/m."""

    title = "Steps of stiffness on a rail"
    duration = 17.0

    def nominal(self) -> Parts:
        # 30 mm of way at first, 7.5 mm at the stiffest. All assumed.
        return self._parts((1000.0, 2000.0, 4000.0, 2000.0), 30.0, 2300.0)

    def varied(self) -> Parts:
        stiffness = ((1000.0, 1500.0), (1800.0, 2500.0), (3000.0, 5000.0), (1000.0, 2500.0))
        return self._parts(stiffness, (10.0, 40.0), (1500.0, 2400.0))

    def _parts(self, stiffness: tuple[Range, ...], push: Range, pneumatic: Range) -> Parts:
        """With stiffnesses, N/m, and a push outward along the rail, N, whole after 2 s."""
        phases = len(STARTS)
        schedule = StiffnessSchedule(STARTS, stiffness, (4600.0,) * phases, (pneumatic,) * phases)
        return FixedTarget(self.middle), Ramp(push, self.inclination), schedule
