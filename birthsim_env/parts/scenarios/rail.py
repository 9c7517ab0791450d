"""One cylinder on a rail."""

import math
from typing import Self

from birthsim_env.parts.drawn.seeding import Range
from birthsim_env.parts.hands.steps import AlternatingSteps
from birthsim_env.parts.references import Sine
from birthsim_env.parts.scenarios import Parts, Scenario
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import RAIL
from birthsim_env.registry import register


class PushesAlong(AlternatingSteps):
    """The pushes of ``AlternatingSteps`` to and fro along a rail of an ``inclination``, rad."""

    def __init__(self, inclination: float, amplitude: Range = 30.0) -> None:
        super().__init__(amplitude)
        x, y = exact.direction(inclination)
        self.directions = ((x, y), (-x, -y)) * 2


class OnRail(Scenario):
    """A scenario of a rig with one cylinder, whose places follow from the rail."""

    linkage = RAIL
    scored = True

    def __init__(self) -> None:
        self._rig = Parameters().replace({"linkage.kind": RAIL})

    def on(self, rig: Parameters) -> Self:
        super().on(rig)
        self._rig = rig
        return self

    @property
    def inclination(self) -> float:
        """Of the rail, rad."""
        return self._rig.linkage.inclination

    @property
    def middle(self) -> tuple[float, float]:
        """x and y of the carriage at mid stroke, m."""
        k2 = self._rig.geometry.k2
        return k2 * math.cos(self.inclination), k2 * math.sin(self.inclination)

    def along(self, strokes: Range) -> Range:
        """A length, m, or a range of lengths, of so many ``strokes``."""
        stroke = self._rig.cylinder2.stroke
        return (strokes[0] * stroke, strokes[1] * stroke) if isinstance(strokes, tuple) else strokes * stroke


@register(scenario="rail", about="One cylinder follows a sine under pushes; after 8 s the stiffness doubles.", order=7)
class Rail(OnRail):
    """One cylinder on a rail: a sine under pushes of 30 N, stiffness 2000 then 4000 N/m."""

    title = "One cylinder on a rail"
    duration = 16.0

    def nominal(self) -> Parts:
        # As on the circle: 0.09 m/s at most with 0.4 m of stroke, and the pneumatic stiffness of its cylinder 2. All assumed.
        stiffness = StiffnessSchedule((0.0, 8.0), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0))
        return self._sine(0.15, 4.0), PushesAlong(self.inclination), stiffness

    def varied(self) -> Parts:
        setpoints = (1000.0, 5000.0)
        stiffness = StiffnessSchedule((0.0, 8.0), (setpoints, setpoints), ((3000.0, 4800.0),) * 2, ((1500.0, 2400.0),) * 2)
        return self._sine((0.08, 0.25), (3.0, 6.0)), PushesAlong(self.inclination, (10.0, 40.0)), stiffness

    def _sine(self, strokes: Range, period: Range) -> Sine:
        """A sine about mid stroke, with an amplitude in ``strokes``."""
        return Sine(self.middle, self.inclination, self.along(strokes), period)
