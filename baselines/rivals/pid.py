"""Position PID per piston with a pressure loop inside each chamber.

With e = yd - y and the apparent mass m_e (m kappa^2 of cylinder 1, m of cylinder 2) at the reference pose, the outer loop asks
for the force
    F = F* + m_e (w^2 e + 2 zeta w (vd - v)) + I,   dI/dt = m_e w^2 a (e beyond the dead zone)
within what the supply can give. F and the setpoint of the pneumatic stiffness (9) make two pressures,
    F = Pp Sp - Pn Sn,   K = k (Pp Sp/Lp + Pn Sn/Ln),
and each chamber's flow is (6) solved for dP/dt = b (P* - P): proportional, with the piston's speed compensated.

These commands found the gains (with ideal, then with lab). The second starts from what the first found:
    birthsim tune --controller pid --trials 75 --seed 0 --sensors ideal --out out/first
    birthsim tune --controller pid --trials 45 --seed 1 --sensors ideal --start out/first/gains.json --out out/again
"""

from typing import ClassVar

from baselines.admittance.law import beyond
from baselines.rivals.feedforward import Tracking
from baselines.rivals.tracking import Integrals, TrackingController, carry_on, held
from baselines.valve_inverse import CylinderAir, air_at, driving_flows, valve_of
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, number, part
from birthsim_env.physics.pneumatics import valves
from birthsim_env.registry import register


@helper
def pressure_setpoints(
    force: float, stiffness: float, c: CylinderAir, index: float, low: float, high: float
) -> tuple[float, float]:
    """Pressures of chambers P and N, Pa, that hold ``force`` (N) at ``stiffness`` (N/m), between ``low`` and ``high``.

    Where both cannot be had the stiffness gives way; ``force`` must lie within low ap - high an and high ap - low an.
    """
    a = (stiffness / index + force / c.length_n) / (1.0 / c.length_p + 1.0 / c.length_n)
    a = max(max(low * c.ap, low * c.an + force), min(min(high * c.ap, high * c.an + force), a))
    return a / c.ap, (a - force) / c.an


@helper
def flow_for(rate: float, pressure: float, area: float, length: float, length_rate: float, index: float, gas_t: float) -> float:
    """The mass flow, kg/s, that gives dP/dt = ``rate`` (Pa/s) in (6)."""
    return (area * length * rate / index + pressure * area * length_rate) / gas_t


class Constants(Numbers):
    """Of the stage; the gains are those of ``PositionPID``."""

    period = number("s", "control period")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    integral_rate = number("1/s", "a")
    pressure_gain = number("1/s", "b")
    dead_zone = number("m", "at the end effector")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Integrals, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the integrals, N, on."""
    tracked, p = Tracking(seen.intermediate[: Tracking.size]), constants.rig
    pressure, opening = seen.pressure, seen.opening
    setpoint = seen.asked.pneumatic_stiffness
    wanted, needed, position, speed = tracked.wanted, tracked.needed, tracked.joints.position, tracked.joints.speed
    bandwidth, damping, zone = constants.bandwidth, constants.damping, constants.dead_zone
    index, gas_t = p.index, p.gas * p.temperature
    low, high = p.atmosphere, p.supply
    for cylinder in range(2):
        row = 2 * cylinder
        ap, an = (p.area_p1, p.area_n1) if cylinder == 0 else (p.area_p2, p.area_n2)
        for i in range(n):
            y, v, pp, pn = position[cylinder, i], speed[cylinder, i], pressure[row, i], pressure[row + 1, i]
            scale = needed.kappa[i] if cylinder == 0 else 1.0
            spring = p.mass * scale * scale * bandwidth * bandwidth
            error, error_rate = wanted.position[cylinder, i] - y, wanted.speed[cylinder, i] - v
            force = needed.force[cylinder, i]
            summed = held(memory, cylinder, i, pp * ap - pn * an - force)
            force += spring * (error + 2.0 * damping / bandwidth * error_rate) + summed
            least, most = low * ap - high * an, high * ap - low * an
            given = max(least, min(most, force))
            air = air_at(cylinder, pp, pn, y, v, p)
            pp_set, pn_set = pressure_setpoints(given, setpoint[cylinder, i], air, index, low, high)
            flow_p = flow_for(constants.pressure_gain * (pp_set - pp), pp, ap, air.length_p, v, index, gas_t)
            flow_n = flow_for(constants.pressure_gain * (pn_set - pn), pn, an, air.length_n, -v, index, gas_t)
            (fill_p, drain_p), (fill_n, drain_n) = driving_flows(pp, p), driving_flows(pn, p)
            opening_p = valves.opening_for_flow(flow_p, fill_p, drain_p, valve_of(row, p))
            opening_n = valves.opening_for_flow(flow_n, fill_n, drain_n, valve_of(row + 1, p))
            opening[row, i], opening[row + 1, i] = opening_p, opening_n
            rate = spring * constants.integral_rate * beyond(error, zone / scale) if given == force else 0.0
            carry_on(memory, cylinder, i, summed, rate, constants.period, (opening_p, opening_n))
    return 0


@register(
    controller="pid",
    about="A position controller on the motion that the spring would make: what most would try first.",
    needs={"force sensor"},
    order=30,
)
class PositionPID(TrackingController):
    """Position PID with a pressure loop inside (this module), following the compliant motion.

    Arguments are those of ``TrackingController``, with the gains bandwidth: w, 1/s, of the position loop; damping: zeta,
    of the speed error; integral_rate: a, 1/s; pressure_gain: b, 1/s, of the pressure loops; friction_fraction; dead_zone.
    """

    LAW, CONSTANTS = staticmethod(control), Constants
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (15.0, 100.0, 69.12, 40.47),
        "damping": (0.1, 2.0, 0.3865, 0.6882),
        "integral_rate": (0.5, 30.0, 16.48, 12.19),
        "pressure_gain": (40.0, 400.0, 337.7, 328.3),
        "friction_fraction": (0.0, 1.0, 0.4213, 0.6659),
        "dead_zone": (0.0, 5e-4, 7.36e-05, 7.683e-05),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {name: gains[name] for name in Constants.groups if name in gains}
