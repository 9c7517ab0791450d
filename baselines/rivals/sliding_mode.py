"""Sliding mode of each piston about the motion that it follows.

With e = y - yd, its derivatives from the measured pressures by the control model, d2e/dt2 = (F - F* - Fv de/dt)/m_e, and the
integral E of e beyond a dead zone, the surface is of third order in E,
    s = (d/dt + r)^3 E = d2e/dt2 + 3 r de/dt + 3 r^2 e + r^3 E.
By (5) and (10) the equivalent control and the switching term in a boundary layer,
    dF/dt = dF*/dt + Fv d2e/dt2 - m_e (3 r d2e/dt2 + 3 r^2 de/dt + r^3 dE/dt) - m_e h sat(s/layer),   layer = h/b,
make ds/dt = -h sat(s/layer): the layer is reached in (|s| - layer)/h, inside s decays at the rate b. s, h and layer are those
at the end effector (kappa s of cylinder 1). h must beat 3 r times the acceleration by which the model is wrong. dF/dt goes to
the valves as in the paper, with its regulation of the pneumatic stiffness.

This command found the gains (with ideal, then with lab):
    birthsim tune --controller sliding-mode --trials 75 --seed 0 --sensors ideal --out out/tune/sliding-mode-ideal
"""

from typing import ClassVar

from baselines.admittance.law import beyond
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import Tracking
from baselines.rivals.piston_loop import open_valves, piston_error
from baselines.rivals.tracking import Integrals, TrackingController, carry_on, held
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, number, part
from birthsim_env.registry import register


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period")
    surface_rate = number("1/s", "r")
    reaching_rate = number("m/s3", "h")
    layer_rate = number("1/s", "b")
    dead_zone = number("m", "at the end effector")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Integrals, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the integrals, m s, on."""
    tracked, p = Tracking(seen.intermediate[: Tracking.size]), constants.rig
    r, reaching, inside, zone = constants.surface_rate, constants.reaching_rate, constants.layer_rate, constants.dead_zone
    for cylinder in range(2):
        viscous = p.fv1 if cylinder == 0 else p.fv2
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            mass, error_rate = now.mass, now.error_rate
            second = (now.excess - viscous * error_rate) / mass
            summed = held(memory, cylinder, i, -now.excess / (mass * r * r * r))
            slope = beyond(now.error, zone / now.scale)
            surface = now.scale * (second + r * (3.0 * error_rate + r * (3.0 * now.error + r * summed)))
            switched = max(-reaching, min(reaching, inside * surface)) / now.scale
            turned = viscous / mass * second - r * (3.0 * second + r * (3.0 * error_rate + r * slope)) - switched
            rate = tracked.needed.rate[cylinder, i] + mass * turned
            opened = open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            carry_on(memory, cylinder, i, summed, slope, constants.period, opened)
    return 0


@register(
    controller="sliding-mode",
    about="A sliding-mode controller on the motion that the spring would make.",
    needs={"force sensor"},
    order=32,
)
class SlidingMode(TrackingController):
    """Third-order sliding mode about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction, dead_zone and three more:

    - surface_rate: r, 1/s, at which errors decay on the surface;
    - reaching_rate: h, m/s3, at which the boundary layer is approached;
    - layer_rate: b, 1/s, at which s decays inside the layer, which is h/b thick.
    """

    LAW, CONSTANTS = staticmethod(control), Constants
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "surface_rate": (10.0, 100.0, 33.97, 24.36),
        "reaching_rate": (100.0, 10000.0, 1920.0, 4990.0),
        "layer_rate": (10.0, 200.0, 117.1, 194.0),
        "friction_fraction": (0.0, 1.0, 0.2342, 0.9921),
        "dead_zone": (0.0, 5e-4, 2.405e-05, 5.875e-05),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {"pneumatic_gain": PNEUMATIC_GAIN, **{name: gains[name] for name in Constants.groups if name in gains}}
