"""A scenario of a user's own: a stroll of 40 mm along x under a push."""

from birthsim_env import Path, StiffnessSchedule
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.scenarios import Scenario
from birthsim_env.registry import register


@register(scenario="stroll", about="The head strolls 40 mm along x under a push.")
class Stroll(Scenario):
    """a stroll of 40 mm along x under a push of 15 N"""

    title = "A stroll of 40 mm"
    duration = 3.0

    def nominal(self):
        return Path((0.48, 0.0), 0.0, 0.04, ends=2.0), Ramp(amplitude=15.0), StiffnessSchedule()
