"""Time-delay control of each piston about the motion that it follows.

K. Youcef-Toumi and O. Ito, Journal of Dynamic Systems, Measurement, and Control 112(1), 1990; T. C. Hsia and L. S. Gao, IEEE
International Conference on Robotics and Automation, 1990. What the model lacked a delay L ago is taken for what it lacks now:
    d^ = (de/dt(t) - de/dt(t - L))/L - mean of D/m_e over the same time,
so that the force has the desired error dynamics of bandwidth w and damping zeta, and is followed at the rate b:
    D* = m_e (-w^2 e - 2 zeta w de/dt - d^ - g s),   u = dF*/dt + dD*/dt + b (D* - D).
The papers take the force at t - L itself; its mean belongs to the mean acceleration that the two speeds give. The last term is
the ideal velocity feedback of M. Jin, S. H. Kang and P. H. Chang, IEEE Transactions on Industrial Electronics 55(1), 2008: dry
friction that changes within L escapes the estimate, and the distance from the speed that the desired dynamics would have,
    s = de/dt + 2 zeta w e + w^2 (integral of e beyond the dead zone),
is fed back at the rate g. The integral starts at s = 0, and rests while a valve saturates.

The estimate is a disturbance observer (``disturbance_observer``) with the filter Q = (1 - exp(-L s))/(L s), and with g > 0
there is an integrator beside it.

Gains found by ``birthsim tune``, as those of ``pid``.
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
from birthsim_env.physics.compiled.records import Numbers, number, part, rows
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import register

LONGEST = 64
"""Control periods that the delay has at most."""


class Past(Integrals):
    """The integrals of the errors, m s, and the last ``LONGEST`` periods."""

    slot = rows("slot1 slot2", "1", "of a cylinder that is written next")
    speed = rows(2 * LONGEST, "m/s", "de/dt of cylinder 1, then of cylinder 2, slot by slot")
    pushed = rows(2 * LONGEST, "m/s2", "D/m_e likewise")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period T")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    periods = number("1", "of the delay L")
    ideal_velocity_rate = number("1/s", "g")
    force_rate = number("1/s", "b")
    dead_zone = number("m", "at the end effector")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Past, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries past and integrals on."""
    tracked, p, period = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.period
    w, zeta, b, g = constants.bandwidth, constants.damping, constants.force_rate, constants.ideal_velocity_rate
    periods = int(constants.periods)
    for cylinder in range(2):
        begin = cylinder * LONGEST
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            e, v, pushed = now.error, now.error_rate, now.excess / now.mass
            if memory.fresh[cylinder, i] > 0.0:
                # It starts as if it had always been so: d^ = -D/m_e.
                for j in range(LONGEST):
                    memory.speed[begin + j, i], memory.pushed[begin + j, i] = v, pushed
            slot, total = int(memory.slot[cylinder, i]), 0.0
            for j in range(1, periods + 1):
                total += memory.pushed[begin + (slot - j + LONGEST) % LONGEST, i]
            before = memory.speed[begin + (slot - periods + LONGEST) % LONGEST, i]
            disturbance = (v - before) / (periods * period) - total / periods
            memory.speed[begin + slot, i], memory.pushed[begin + slot, i] = v, pushed
            memory.slot[cylinder, i] = (slot + 1) % LONGEST
            acceleration = pushed + disturbance
            summed = held(memory, cylinder, i, -(v + 2.0 * zeta * w * e) / (w * w))
            slope = beyond(e, constants.dead_zone / now.scale)
            away = v + w * (2.0 * zeta * e + w * summed)
            away_rate = acceleration + w * (2.0 * zeta * v + w * slope)
            wanted = -w * (w * e + 2.0 * zeta * v) - disturbance - g * away
            turned = -w * (w * v + 2.0 * zeta * acceleration) - g * away_rate
            rate = tracked.needed.rate[cylinder, i] + now.mass * (turned + b * (wanted - pushed))
            opened = open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            carry_on(memory, cylinder, i, summed, slope, period, opened)
    return 0


@register(
    controller="time-delay",
    about="What the model lacked a moment ago is taken for what it lacks now, and cancelled.",
    needs={"force sensor"},
    order=35,
)
class TimeDelayControl(TrackingController):
    """Time-delay control with ideal velocity feedback about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction, dead_zone and five more:

    - bandwidth and damping: w, 1/s, and zeta of the desired error dynamics;
    - delay: L, s, rounded to control periods, of which it has 1 to ``LONGEST``;
    - ideal_velocity_rate: g, 1/s; zero is time-delay control without it;
    - force_rate: b, 1/s, at which the force is followed.

    Raises ``ValueError`` for a delay that is longer.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, Past
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (10.0, 100.0, 20.7, 12.14),
        "damping": (0.3, 2.0, 1.967, 1.883),
        "delay": (1e-3, 4e-2, 0.001337, 0.004803),
        "ideal_velocity_rate": (0.0, 60.0, 51.64, 29.88),
        "force_rate": (30.0, 300.0, 296.7, 72.88),
        "friction_fraction": (0.0, 1.0, 0.403, 0.0617),
        "dead_zone": (0.0, 5e-4, 0.000272, 0.00044),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        period = self.parameters.electronics.control_period
        periods = max(1, round(gains["delay"] / period))
        if periods > LONGEST:
            given, longest = shown(gains["delay"]), f"{LONGEST * period:g} s, {LONGEST} control periods of {period:g} s"
            raise ValueError(f"delay = {given}; allowed: up to {longest}")
        own = {name: gains[name] for name in Constants.groups if name in gains}
        return {"periods": periods, "pneumatic_gain": PNEUMATIC_GAIN, **own}
