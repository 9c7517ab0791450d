"""Active disturbance rejection of each piston about the motion that it follows.

With e = y - yd and D = F - F* the control model (5), (10) is, per piston, d2e/dt2 = D/m_e + d, where the disturbance d is all
that the model lacks. A reduced-order observer of the bandwidth o finds it from the speed,
    d^ = z + o de/dt,   dz/dt = -o (d^ + D/m_e),
and the force rate u = b (m_e (-w^2 e - 2 zeta w de/dt - d^) - D) + dF*/dt goes to the valves as in the paper, with its
regulation of the pneumatic stiffness. J. Han, IEEE Transactions on Industrial Electronics 56(3), 2009. Gains by trial.
"""

from typing import ClassVar

from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import Tracking
from baselines.rivals.tracking import Integrals, TrackingController, carry_on, held
from baselines.valve_inverse import air_at, stiffness_of, two_valve_openings
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, number, part
from birthsim_env.registry import register


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    observer_bandwidth = number("1/s", "o")
    force_rate = number("1/s", "b")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Integrals, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the observers' z, m/s2, on."""
    tracked, p = Tracking(seen.intermediate[: Tracking.size]), constants.rig
    setpoint, setpoint_rate = seen.asked.pneumatic_stiffness, seen.asked.pneumatic_stiffness_rate
    wanted, needed, joints = tracked.wanted, tracked.needed, tracked.joints
    w, observer = constants.bandwidth, constants.observer_bandwidth
    for cylinder in range(2):
        row = 2 * cylinder
        ap, an = (p.area_p1, p.area_n1) if cylinder == 0 else (p.area_p2, p.area_n2)
        for i in range(n):
            y, v = joints.position[cylinder, i], joints.speed[cylinder, i]
            pp, pn = seen.pressure[row, i], seen.pressure[row + 1, i]
            scale = needed.kappa[i] if cylinder == 0 else 1.0
            mass = p.mass * scale * scale
            excess = pp * ap - pn * an - needed.force[cylinder, i]
            error, error_rate = y - wanted.position[cylinder, i], v - wanted.speed[cylinder, i]
            state = held(memory, cylinder, i, -observer * error_rate)
            disturbance = state + observer * error_rate
            wished = -w * (w * error + 2.0 * constants.damping * error_rate) - disturbance
            rate = needed.rate[cylinder, i] + constants.force_rate * (mass * wished - excess)
            air = air_at(cylinder, pp, pn, y, v, p)
            away = stiffness_of(air, p) - setpoint[cylinder, i]
            opened = two_valve_openings(rate, setpoint_rate[cylinder, i] - constants.pneumatic_gain * away, air, p)
            seen.opening[row, i], seen.opening[row + 1, i] = opened
            carry_on(memory, cylinder, i, state, -observer * (disturbance + excess / mass), constants.period, opened)
    return 0


@register(controller="adrc", about="Cancels whatever its model lacks, as an observer finds it.", needs={"force sensor"})
class ADRC(TrackingController):
    """Active disturbance rejection about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction and four more: bandwidth w, 1/s, damping
    zeta, observer_bandwidth o, 1/s, and force_rate b, 1/s.
    """

    LAW, CONSTANTS = staticmethod(control), Constants
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (10.0, 100.0, 45.0, 30.0),
        "damping": (0.5, 2.0, 1.0, 1.0),
        "observer_bandwidth": (10.0, 300.0, 150.0, 30.0),
        "force_rate": (30.0, 300.0, 120.0, 100.0),
        "friction_fraction": (0.0, 1.0, 0.5, 0.7),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {"pneumatic_gain": PNEUMATIC_GAIN, **{name: gains[name] for name in Constants.groups if name in gains}}
