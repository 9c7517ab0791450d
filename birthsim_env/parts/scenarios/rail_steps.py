"""Steps of position on a rail, as pneumatic positioning is mostly measured."""

from birthsim_env.parts.drawn.seeding import Range
from birthsim_env.parts.hands.user_forces import ForceProfile
from birthsim_env.parts.position_steps import PositionSteps
from birthsim_env.parts.scenarios import Parts
from birthsim_env.parts.scenarios.rail import OnRail
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.registry import register

STARTS = (1.0, 4.0, 7.0, 10.0, 13.0)
"""s; assumed: 2 s of rest after each move show where dry friction holds the carriage, and whether it hunts."""

LASTS = 1.0
"""s that a move takes; assumed: at most 0.3 m/s over 0.4 of a stroke of 0.4 m, a third of what the default valves allow."""


@register(scenario="rail-steps", about="One cylinder goes from place to place and rests there; nobody pushes.", order=8)
class RailSteps(OnRail):
    """One cylinder goes to five places, 5 to 160 mm apart, and rests for 2 s at each; nobody pushes."""

    title = "Steps of position on a rail"
    duration = 16.0

    def nominal(self) -> Parts:
        # Long moves over mid stroke, one as short as what friction can swallow, and back. All assumed, in strokes.
        return self._parts((0.2, -0.2, 0.05, 0.0625, 0.0), 2000.0, 2300.0)

    def varied(self) -> Parts:
        places = ((0.1, 0.25), (-0.25, -0.1), (-0.1, 0.1), (-0.1, 0.1), (-0.25, 0.25))
        return self._parts(places, (1000.0, 5000.0), (1500.0, 2400.0))

    def _parts(self, places: tuple[Range, ...], stiffness: Range, pneumatic: Range) -> Parts:
        """Moves to ``places``, in strokes from the middle, with stiffnesses, N/m."""
        target = PositionSteps(self.middle, self.inclination, STARTS, tuple(map(self.along, places)), LASTS)
        return target, ForceProfile(), StiffnessSchedule((0.0,), (stiffness,), (4600.0,), (pneumatic,))
