"""Super-twisting sliding mode of each piston about the motion that it follows.

A. Levant, "Sliding order and sliding accuracy in sliding mode control", International Journal of Control 58(6), 1993. With the
surface of ``sliding_mode``, of third order in the integral E of the error e beyond a dead zone,
    s = (d/dt + r)^3 E = d2e/dt2 + 3 r de/dt + 3 r^2 e + r^3 E,   d2e/dt2 = (D - Fv de/dt)/m_e,
the equivalent control leaves ds/dt = 3 r d, d being what the model of ``piston_loop`` lacks. In place of the saturation there,
which has to beat d and is a boundary layer thick, stands a continuous term that reaches s = 0 in finite time:
    ds/dt = -k1 |s|^(1/2) sign(s) + z + 3 r d,   dz/dt = -k2 sign(s).
With k1 = 1.8 L^(1/2) and k2 = 1.1 L it does so wherever |3 r dd/dt| <= L, by the frequency condition of J. A. Moreno and
M. Osorio, "Strict Lyapunov functions for the super-twisting algorithm", IEEE Transactions on Automatic Control 57(4), 2012:
|G(jw)| < 1/L for G(s) = 1/2 / (s^2 + k1/2 s + k2/2), whose peak is 0.94/L. Dry friction that jumps is beyond any L.

s is that at the end effector (kappa s of cylinder 1). The term is sampled implicitly (B. Brogliato, A. Polyakov and D. Efimov,
IEEE Transactions on Automatic Control 65(8), 2020): it asks for the s+ after the period that solves it with sign(s+), so that
sampling alone causes no chatter; the lag of the spools still does where L is large. E and z rest while a valve saturates.

Gains found by ``birthsim tune``, as those of ``pid``.
"""

import math
from typing import ClassVar

from baselines.admittance.law import beyond
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import Tracking
from baselines.rivals.piston_loop import open_valves, piston_error
from baselines.rivals.tracking import Integrals, TrackingController, carry_on, held, is_full
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, number, part, rows
from birthsim_env.registry import register

ROOT_GAIN, SIGN_GAIN = 1.8, 1.1
"""k1/L^(1/2) and k2/L."""


class Twisting(Integrals):
    """The integrals E, m s, and those of the sign."""

    sign = rows("z1 z2", "m/s3", "z")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period T")
    surface_rate = number("1/s", "r")
    root_gain = number("m1/2/s3/2", "k1")
    sign_gain = number("m/s4", "k2")
    dead_zone = number("m", "at the end effector")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@helper
def twist(s: float, z: float, k1: float, k2: float, period: float) -> tuple[float, float]:
    """s and z after a period: s+ = s - T k1 |s+|^(1/2) sign(s+) + T z+ and z+ = z - T k2 sign(s+), solved for s+."""
    free = s + period * z
    beyond_reach = abs(free) - period * period * k2
    if beyond_reach <= 0.0:  # sign(0) is any number in [-1, 1]: the one that leads to s+ = 0
        return 0.0, -s / period
    half = 0.5 * period * k1
    root = math.sqrt(half * half + beyond_reach) - half
    way = 1.0 if free > 0.0 else -1.0
    return way * root * root, z - period * k2 * way


@kernel
def control(world: int, seen: Seen, memory: Twisting, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the integrals on."""
    tracked, p, period = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.period
    r, k1, k2, zone = constants.surface_rate, constants.root_gain, constants.sign_gain, constants.dead_zone
    for cylinder in range(2):
        viscous = p.fv1 if cylinder == 0 else p.fv2
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            mass, error_rate = now.mass, now.error_rate
            second = (now.excess - viscous * error_rate) / mass
            summed = held(memory, cylinder, i, -now.excess / (mass * r * r * r))
            slope = beyond(now.error, zone / now.scale)
            surface = now.scale * (second + r * (3.0 * error_rate + r * (3.0 * now.error + r * summed)))
            after, sign = twist(surface, memory.sign[cylinder, i], k1, k2, period)
            turned = viscous / mass * second - r * (3.0 * second + r * (3.0 * error_rate + r * slope))
            turned += (after - surface) / (period * now.scale)
            rate = tracked.needed.rate[cylinder, i] + mass * turned
            opened = open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            carry_on(memory, cylinder, i, summed, slope, period, opened)
            if not is_full(opened):
                memory.sign[cylinder, i] = sign
    return 0


@register(
    controller="super-twisting",
    about="Super-twisting sliding mode: a continuous term in place of the switching one.",
    needs={"force sensor"},
    order=36,
)
class SuperTwisting(TrackingController):
    """Super-twisting sliding mode about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction, dead_zone and two more:

    - surface_rate: r, 1/s, at which errors decay on the surface;
    - rate_bound: L, m/s4: how fast 3 r d may change at the end effector.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, Twisting
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "surface_rate": (10.0, 100.0, 29.88, 24.75),
        "rate_bound": (1e2, 1e6, 2.176e04, 4.798e04),
        "friction_fraction": (0.0, 1.0, 0.8326, 0.903),
        "dead_zone": (0.0, 5e-4, 3.181e-05, 4.223e-06),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        bound = gains["rate_bound"]
        return {
            "surface_rate": gains["surface_rate"],
            "root_gain": ROOT_GAIN * math.sqrt(bound),
            "sign_gain": SIGN_GAIN * bound,
            "dead_zone": gains["dead_zone"],
            "pneumatic_gain": PNEUMATIC_GAIN,
        }
