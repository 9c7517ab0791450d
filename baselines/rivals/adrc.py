"""Active disturbance rejection of each piston about the motion that it follows, with an extended state observer.

J. Han, "From PID to active disturbance rejection control", IEEE Transactions on Industrial Electronics 56(3), 2009; with the
linear observer that Z. Gao, American Control Conference 2003, parametrises by its bandwidth o. All that the model of
``piston_loop`` lacks is a third state z3 beside z1 = e and z2 = de/dt,
    dz1/dt = z2 + 3 o (e - z1),   dz2/dt = z3 + D/m_e + 3 o^2 (e - z1),   dz3/dt = o^3 (e - z1),
and the force that cancels it, with the loop of bandwidth w and damping zeta, is followed at the rate b:
    D* = m_e (-w^2 z1 - 2 zeta w z2 - z3),   u = dF*/dt + dD*/dt + b (D* - D),
    dD*/dt = m_e (-w^2 z2 - 2 zeta w (z3 + D/m_e)).
D is measured, not commanded, so that a saturated valve winds nothing up. The observer is sampled: it predicts over a period,
then corrects by the gains of the fading-memory filter, whose triple pole 1/(1 + o T) no bandwidth makes unstable.

From D and e to z3 this is a disturbance observer with Q = o^3/(s + o)^3 (``disturbance_observer``); what differs is that the
feedback, too, takes the observer's states in place of the measured ones. The admittance family has an extended state of the
speed alone (``baselines.estimation.disturbance_observer``), which is the reduced-order form of this observer.

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


class ExtendedState(Rows):
    """What the observer predicts for the next period."""

    position = rows("1 2", "m", "z1")
    speed = rows("1 2", "m/s", "z2")
    disturbance = rows("1 2", "m/s2", "z3")
    fresh = rows("1 2", "1", "1 where it starts")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period T")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    position_correction = number("1", "of z1, per error")
    speed_correction = number("1/s", "of z2")
    disturbance_correction = number("1/s2", "of z3")
    force_rate = number("1/s", "b")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: ExtendedState, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the observers on."""
    tracked, p, period = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.period
    w, zeta, b = constants.bandwidth, constants.damping, constants.force_rate
    for cylinder in range(2):
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            pushed = now.excess / now.mass
            first = memory.fresh[cylinder, i] > 0.0
            z1 = now.error if first else memory.position[cylinder, i]
            z2 = now.error_rate if first else memory.speed[cylinder, i]
            z3 = -pushed if first else memory.disturbance[cylinder, i]
            wrong = now.error - z1
            z1 += constants.position_correction * wrong
            z2 += constants.speed_correction * wrong
            z3 += constants.disturbance_correction * wrong
            acceleration = z3 + pushed
            wanted = -w * (w * z1 + 2.0 * zeta * z2) - z3
            turned = -w * (w * z2 + 2.0 * zeta * acceleration)
            rate = tracked.needed.rate[cylinder, i] + now.mass * (turned + b * (wanted - pushed))
            open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            memory.position[cylinder, i] = z1 + period * (z2 + 0.5 * period * acceleration)
            memory.speed[cylinder, i] = z2 + period * acceleration
            memory.disturbance[cylinder, i], memory.fresh[cylinder, i] = z3, 0.0
    return 0


def fading_memory(pole: float, period: float) -> tuple[float, float, float]:
    """What position, speed and acceleration are corrected by, per position error, for three equal poles.

    Of the filter that forgets: P. Zarchan and H. Musoff, "Fundamentals of Kalman Filtering", chapter on fading memory."""
    left = 1.0 - pole
    return 1.0 - pole**3, 1.5 * left**2 * (1.0 + pole) / period, left**3 / period**2


@register(
    controller="adrc",
    about="Active disturbance rejection: an observer finds what the model lacks, and the loop cancels it.",
    needs={"force sensor"},
    order=33,
)
class ActiveDisturbanceRejection(TrackingController):
    """Active disturbance rejection about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction and four more: bandwidth: w, 1/s, of the
    position loop; damping: zeta; observer_bandwidth: o, 1/s; force_rate: b, 1/s, at which the force is followed.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, ExtendedState
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (10.0, 100.0, 58.82, 41.85),
        "damping": (0.3, 2.0, 0.542, 0.4643),
        "observer_bandwidth": (10.0, 800.0, 781.8, 476.6),
        "force_rate": (30.0, 300.0, 203.1, 47.02),
        "friction_fraction": (0.0, 1.0, 0.7086, 0.5707),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        period = self.parameters.electronics.control_period
        corrections = fading_memory(1.0 / (1.0 + gains["observer_bandwidth"] * period), period)
        names = ("position_correction", "speed_correction", "disturbance_correction")
        own = {name: gains[name] for name in ("bandwidth", "damping", "force_rate")}
        return {**own, **dict(zip(names, corrections, strict=True)), "pneumatic_gain": PNEUMATIC_GAIN}
