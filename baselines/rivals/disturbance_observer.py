"""Disturbance-observer based control of each piston about the motion that it follows.

K. Ohnishi, "A new servo method in mechatronics", Trans. Japan Society of Electrical Engineers 107-D, 1987; K. Ohnishi,
M. Shibata and T. Murakami, IEEE/ASME Transactions on Mechatronics 1(1), 1996; W.-H. Chen, J. Yang, L. Guo and S. Li, IEEE
Transactions on Industrial Electronics 63(2), 2016. The inverse of the nominal model, m_e s^2 + Fv s, says what force the
motion took; less the force D that the chambers gave, and through a filter, that is the disturbance of ``piston_loop``:
    d^ = Q(s) (s^2 e + Fv/m_e s e - D/m_e),   Q = q^2/(s^2 + sqrt(2) q s + q^2),
a second-order Butterworth filter, so that the inverse is proper and no acceleration is differentiated. The loop of bandwidth w
and damping zeta is that of the nominal model, and the force is followed at the rate b:
    D* = m_e (-w^2 e - 2 zeta w de/dt - d^) + Fv de/dt,   u = dF*/dt + dD*/dt + b (D* - D),
dD*/dt with the acceleration (D - Fv de/dt)/m_e + d^. D is measured, not commanded: a saturated valve winds nothing up.

With Q = o^3/(s + o)^3 and without Fv the observer would be that of ``adrc``, and with an average over L that of ``time_delay``.
The admittance family contains one from the measured speed (``baselines.estimation.disturbance_observer``), Q = w^2/(s + w)^2.
What it finds goes into a stiff backstepping loop there, in place of the second-order one here.

Gains found by ``birthsim tune``, as those of ``pid``.
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

ROOT2 = 1.4142135623730951


class Filter(Rows):
    """States of d^ = q^2 e - x1, in observer form."""

    first = rows("x1_1 x1_2", "m/s2", "x1")
    second = rows("x2_1 x2_2", "m/s3", "x2")
    fresh = rows("1 2", "1", "1 where it starts")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period T")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    filter_bandwidth = number("1/s", "q")
    force_rate = number("1/s", "b")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Filter, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the filters on."""
    tracked, p, period = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.period
    w, zeta, q, b = constants.bandwidth, constants.damping, constants.filter_bandwidth, constants.force_rate
    step = q * period
    for cylinder in range(2):
        viscous = p.fv1 if cylinder == 0 else p.fv2
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            e, v, pushed, drag = now.error, now.error_rate, now.excess / now.mass, viscous / now.mass
            # A filter that starts holds d^ = -D/m_e: what the chambers carry is what rests on them.
            first = memory.fresh[cylinder, i] > 0.0
            x1 = q * q * e + pushed if first else memory.first[cylinder, i]
            x2 = q * (q * (v + drag * e) + ROOT2 * pushed) if first else memory.second[cylinder, i]
            # dx1/dt = x2 - sqrt(2) q x1 + in1, dx2/dt = -q^2 x1 + in2: one step of the implicit Euler method.
            in1, in2 = q * q * (ROOT2 * q - drag) * e, q * q * (q * q * e + pushed)
            x1 = (x1 + period * (x2 + in1 + period * in2)) / (1.0 + step * (ROOT2 + step))
            x2 += period * (in2 - q * q * x1)
            disturbance = q * q * e - x1
            acceleration = pushed - drag * v + disturbance
            wanted = -w * (w * e + 2.0 * zeta * v) - disturbance + drag * v
            turned = -w * (w * v + 2.0 * zeta * acceleration) + drag * acceleration
            rate = tracked.needed.rate[cylinder, i] + now.mass * (turned + b * (wanted - pushed))
            open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            memory.first[cylinder, i], memory.second[cylinder, i], memory.fresh[cylinder, i] = x1, x2, 0.0
    return 0


@register(
    controller="disturbance-observer",
    about="The inverse of the model, filtered, finds what pushes besides; the loop takes it off.",
    needs={"force sensor"},
    order=34,
)
class DisturbanceObserverControl(TrackingController):
    """Disturbance-observer based control about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction and four more: bandwidth: w, 1/s, of the
    position loop; damping: zeta; filter_bandwidth: q, 1/s; force_rate: b, 1/s, at which the force is followed.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, Filter
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (10.0, 100.0, 53.85, 40.55),
        "damping": (0.3, 2.0, 0.3238, 0.4),
        "filter_bandwidth": (10.0, 800.0, 703.5, 206.5),
        "force_rate": (30.0, 300.0, 291.7, 154.2),
        "friction_fraction": (0.0, 1.0, 0.705, 0.5895),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {"pneumatic_gain": PNEUMATIC_GAIN, **{name: gains[name] for name in Constants.groups if name in gains}}
