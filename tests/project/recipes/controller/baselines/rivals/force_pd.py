"""Proportional and derivative control of each piston's force about the motion that it follows.

With what ``piston_loop`` sees, the force D* = m_e (-w^2 e - 2 zeta w de/dt) beyond the one that the motion needs is followed at
the rate b: u = dF*/dt + b (D* - D). Nothing is integrated, so what friction the law does not know leaves an error. Gains by
trial.
"""

from typing import ClassVar

from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import Tracking
from baselines.rivals.piston_loop import open_valves, piston_error
from baselines.rivals.tracking import TrackingController
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, rows
from birthsim_env.registry import register


class Nothing(Rows):
    """What it remembers."""

    fresh = rows("1 2", "1", "1 where it starts")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    force_rate = number("1/s", "b")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Nothing, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Opens the valves of both cylinders."""
    tracked, p, w = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.bandwidth
    for cylinder in range(2):
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            wanted = -now.mass * w * (w * now.error + 2.0 * constants.damping * now.error_rate)
            rate = tracked.needed.rate[cylinder, i] + constants.force_rate * (wanted - now.excess)
            open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
    return 0


@register(controller="force-pd", about="Asks for a force by error and speed, and follows it.", needs={"force sensor"})
class ForcePD(TrackingController):
    """Proportional and derivative control of the force about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction and three more: bandwidth w, 1/s, damping
    zeta, and force_rate b, 1/s.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, Nothing
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (10.0, 100.0, 45.0, 30.0),
        "damping": (0.5, 2.0, 1.0, 1.0),
        "force_rate": (30.0, 300.0, 120.0, 100.0),
        "friction_fraction": (0.0, 1.0, 0.5, 0.7),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {"pneumatic_gain": PNEUMATIC_GAIN, **{name: gains[name] for name in Constants.groups if name in gains}}
