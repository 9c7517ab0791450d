"""Adaptive robust control of each piston about the motion that it follows.

B. Yao and M. Tomizuka, "Adaptive robust control of SISO nonlinear systems in a semi-strict feedback form", Automatica 33(5),
1997; for pneumatic cylinders D. Meng, G. Tao and X. Zhu, IEEE Transactions on Control Systems Technology 22(6), 2014. What
the forces F* of ``feedforward`` lack is linear in what is not known, per piston
    phi theta = Fc S(vd) share + (J^T (A + g)) mass + load,
the share of the Coulomb friction beyond the one fed forward, S being the smoothed sign of the reference speed; the mass that
moves beyond the one described, one for both pistons; and a constant load, which at rest is stiction. With s = de/dt + l e,
    D* = phi theta - m_e (l de/dt + k s + h sat(s/layer)),   layer = h/k,
    dtheta/dt = Proj(-gamma phi s beyond the dead zone),
    u = dF*/dt + dD*/dt + b (D* - D).
The projection keeps each theta between bounds, so that nothing winds up, and learning rests while a valve of the cylinder
saturates. The robust term h holds what theta does not describe; within its layer the gain is 2 k. gamma is such that each theta
by itself would settle at the rate a: gamma = a k m_e/phi^2, with the level Fc in phi for the share, and a k m/g^2 for the mass,
which both pistons learn. Yao's second step, which adds -s to u, is left out, and b is high instead. It is phi theta that comes
near the truth; how it is shared out between mass and load, which differ by the motion's acceleration alone, says little.

The admittance family learns share and load too (``baselines.estimation.friction_level``), by least mean squares of the force
that its observer finds unexplained, where this law learns from the tracking error.

While the reference rests (S = 0, the mass acts like a load) this is a PID on the force whose integral, the load, has bounds.

Gains found by ``birthsim tune``, as those of ``pid``.
"""

from typing import ClassVar

from baselines.admittance.law import beyond
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.estimation import dry_friction
from baselines.rivals.feedforward import Tracking, friction_ahead
from baselines.rivals.piston_loop import open_valves, piston_error
from baselines.rivals.tracking import TrackingController, is_full
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.physics.linkage import geometry
from birthsim_env.registry import register

MOST_SHARE, MOST_MASS, MOST_LOAD = 2.0, 0.5, 20.0
"""Bounds of what is learned; assumed. Coulomb friction is up to so many times the one described, mass differs by up to this
fraction of it, and a load is up to so many newtons at the end effector, more than stiction and a force sensor's bias."""

STANDARD_GRAVITY = 9.80665
"""m/s2; with it the mass is learned at the same rate on a rig without weight, where it says less."""


class Learned(Rows):
    """theta."""

    share = rows("share1 share2", "1", "of the Coulomb friction, beyond what is fed forward")
    load = rows("load1 load2", "N", "along a cylinder")
    mass = row("kg", "beyond the one described")
    fresh = rows("1 2", "1", "1 where it starts")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period")
    error_rate = number("1/s", "l")
    feedback_rate = number("1/s", "k")
    robustness = number("m/s2", "h, at the end effector")
    learning_rate = number("1/s", "a")
    learns_mass = number("1", "1 where the mass is learned, as it is at any rate but zero")
    force_rate = number("1/s", "b")
    friction_fraction = number("1", "of the Coulomb friction that is fed forward")
    dead_zone = number("m", "of the error, at the end effector")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@helper
def limit(value: float, low: float, high: float) -> float:
    """Projection onto an interval."""
    return max(low, min(high, value))


@kernel
def control(world: int, seen: Seen, memory: Learned, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries what is learned on."""
    tracked, p, period = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.period
    wanted, motion = tracked.wanted, tracked.motion
    lam, k, h, b = constants.error_rate, constants.feedback_rate, constants.robustness, constants.force_rate
    fed, most_mass = constants.friction_fraction, MOST_MASS * p.mass
    for i in range(n):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            wanted.position[0, i], wanted.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        ax, ay, mass_rate = motion.acceleration[0, i], motion.acceleration[1, i] + p.gravity, 0.0
        for cylinder in range(2):
            now = piston_error(tracked, seen, cylinder, i, p)
            mass, v, vd = now.mass, now.error_rate, wanted.speed[cylinder, i]
            level = dry_friction.level_moving(cylinder, vd, seen.pressure, i, p)
            carried = -kappa * (cosine * ax + sine * ay) if cylinder == 0 else sine * ax - cosine * ay
            most_load = MOST_LOAD * now.scale
            if memory.fresh[cylinder, i] > 0.0:
                memory.load[cylinder, i] = limit(now.excess, -most_load, most_load)
            share, load = memory.share[cylinder, i], memory.load[cylinder, i]
            drag, drag_rate = friction_ahead(vd, wanted.acceleration[cylinder, i], share * level, 0.0)
            known = drag + carried * memory.mass[i] + load
            s = v + lam * now.error
            acceleration = (now.excess - known) / mass
            s_rate = acceleration + lam * v
            inside = 1.0 if abs(k * s) * now.scale < h else 0.0
            robust = limit(k * s, -h / now.scale, h / now.scale)
            force = known - mass * (lam * v + k * s + robust)
            force_rate = drag_rate - mass * (lam * acceleration + (1.0 + inside) * k * s_rate)
            rate = tracked.needed.rate[cylinder, i] + force_rate + b * (force - now.excess)
            opened = open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            if not is_full(opened):
                pace = period * constants.learning_rate * k * beyond(s, lam * constants.dead_zone / now.scale)
                sign, _ = friction_ahead(vd, 0.0, 1.0, 0.0)
                share = limit(share - pace * mass * sign / max(level, 1.0), -fed, MOST_SHARE - fed)
                load = limit(load - pace * mass, -most_load, most_load)
                mass_rate -= pace * carried * p.mass / (STANDARD_GRAVITY * STANDARD_GRAVITY)
            memory.share[cylinder, i], memory.load[cylinder, i], memory.fresh[cylinder, i] = share, load, 0.0
        if constants.learns_mass > 0.0:
            memory.mass[i] = limit(memory.mass[i] + mass_rate, -most_mass, most_mass)
    return 0


@register(
    controller="adaptive-robust",
    about="Learns friction, mass and load between bounds; a robust term holds what these do not describe.",
    needs={"force sensor"},
    order=37,
)
class AdaptiveRobust(TrackingController):
    """Adaptive robust control about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction, from which learning starts, dead_zone and
    five more:

    - error_rate: l, 1/s, at which errors decay where s = 0; feedback_rate: k, 1/s, at which s does;
    - robustness: h, m/s2, of the robust term; zero is adaptive control without it;
    - learning_rate: a, 1/s; zero is robust control that learns nothing;
    - force_rate: b, 1/s, at which the force is followed.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, Learned
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "error_rate": (10.0, 100.0, 36.85, 24.31),
        "feedback_rate": (10.0, 100.0, 25.2, 21.72),
        "robustness": (0.0, 20.0, 19.01, 8.336),
        "learning_rate": (0.0, 60.0, 52.98, 51.14),
        "force_rate": (30.0, 300.0, 291.8, 276.6),
        "friction_fraction": (0.0, 1.0, 0.775, 0.2918),
        "dead_zone": (0.0, 5e-4, 6.794e-05, 0.0003282),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {"pneumatic_gain": PNEUMATIC_GAIN, "learns_mass": gains["learning_rate"] > 0.0, **gains}
