"""Linear-quadratic regulator of each piston about the motion that it follows, with integral action.

With e = y - yd and D = F - F* the control model (5), (10) is, to first order, per piston
    d/dt (integral of e, e, de/dt, D) = (e, de/dt, (D - Fv de/dt)/m_e, u),   u = dF/dt - dF*/dt,
and u = -k (integral, e, de/dt, D) minimises the integral of the squares of these, each over its tolerance (Bryson's rule),
and of u over ``RATE_TOLERANCE``. Tolerances are those at the end effector: lengths count kappa times and forces 1/kappa for
cylinder 1. Its gains are scheduled with kappa at the reference pose. dF/dt goes to the valves as in the paper, with its
regulation of the pneumatic stiffness.

These commands found the gains (with ideal, then with lab). The second starts from what the first found:
    birthsim tune --controller lqr --trials 75 --seed 0 --sensors ideal --out out/first
    birthsim tune --controller lqr --trials 45 --seed 1 --sensors ideal --start out/first/gains.json --out out/again
"""

from typing import Any, ClassVar

import numpy as np

from baselines.admittance.law import beyond
from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import Tracking
from baselines.rivals.piston_loop import open_valves, piston_error
from baselines.rivals.tracking import Integrals, TrackingController, carry_on, held
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, number, part, rows
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register

RATE_TOLERANCE = 1000.0
"""N/s at the end effector; assumed: what the valves give cylinder 1 with something to spare. Only ratios to it matter."""

SCHEDULE = 33
"""Values of kappa in the table, over the whole workspace; linear in between."""


def error_dynamics(mass: float, viscous: float, scale: float) -> tuple[Array, Array]:
    """A (4, 4) and B (4, 1) of one piston's errors: integral (m s), position (m), speed (m/s), force (N).

    ``mass`` m in kg, ``viscous`` Fv in N s/m, ``scale`` kappa for cylinder 1 and 1 for cylinder 2: m_e = m scale^2.
    """
    apparent = mass * scale**2
    a = np.zeros((4, 4))
    a[0, 1] = a[1, 2] = 1.0
    a[2, 2:] = -viscous / apparent, 1.0 / apparent
    return a, np.array([[0.0], [0.0], [0.0], [1.0]])


def regulator(mass: float, viscous: float, scale: float, tolerances: Array) -> Array:
    """Gains k (4,), from the Riccati equation for the tolerances (4,) of integral, position, speed and force.

    It is solved in the natural units of the loop, in which the tolerances of integral and input count 1: SI units span
    too many decades. With time in 1/w the states are w^3 integral, w^2 e, w de/dt and D/m_e.
    """
    from scipy.linalg import solve_continuous_are  # late: it takes 0.3 s, and other controllers do without

    a, b = error_dynamics(mass, viscous, scale)
    apparent = mass * scale**2
    w = (RATE_TOLERANCE / (mass * tolerances[0])) ** 0.25
    unit = np.array([w**3, w**2, w, 1.0 / apparent])
    weights = np.array([scale, scale, scale, 1.0 / scale]) / (tolerances * unit) * (scale * RATE_TOLERANCE) / (apparent * w)
    state, held = unit[:, None] * a / unit / w, unit[:, None] * b * apparent
    gains = held.T @ solve_continuous_are(state, held, np.diag(weights**2), np.eye(1))
    return np.asarray(apparent * w * gains[0] * unit)


def kappa_range(parameters: Parameters) -> tuple[float, float]:
    """Least and largest amplification of cylinder 1 over both strokes."""
    g = parameters.geometry
    r4 = g.k1 + np.linspace(-0.5, 0.5, 101) * parameters.cylinder1.stroke
    arm = 2 * r4 / np.sqrt(4 * g.d3**2 * g.d6**2 - (r4**2 - g.d3**2 - g.d6**2) ** 2)
    half = parameters.cylinder2.stroke / 2
    return float(arm.min() * (g.k2 - half)), float(arm.max() * (g.k2 + half))


@helper
def scheduled(table: Array, row: int, place: float) -> float:
    """Entry ``place`` (not necessarily whole) of one row of a table (8, SCHEDULE), which is flat."""
    left = max(0, min(int(place), SCHEDULE - 2))
    first, second = row * SCHEDULE + left, row * SCHEDULE + left + 1
    entry: float = table[first] + (place - left) * (table[second] - table[first])
    return entry


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period")
    lowest = number("1", "first kappa of the table")
    step = number("1", "from one kappa to the next")
    dead_zone = number("m", "at the end effector")
    pneumatic_gain = number("1/s", "c4")
    table = rows(8 * SCHEDULE, "SI", "gains (8, SCHEDULE) over kappa: four of cylinder 1, then of cylinder 2")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Integrals, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the integrals, m s, on."""
    tracked, p = Tracking(seen.intermediate[: Tracking.size]), constants.rig
    lowest, step, zone = constants.lowest, constants.step, constants.dead_zone
    for cylinder in range(2):
        gain = 4 * cylinder
        for i in range(n):
            now = piston_error(tracked, seen, cylinder, i, p)
            place = (tracked.needed.kappa[i] - lowest) / step
            k1, k2 = scheduled(constants.table, gain, place), scheduled(constants.table, gain + 1, place)
            k3, k4 = scheduled(constants.table, gain + 2, place), scheduled(constants.table, gain + 3, place)
            summed = held(memory, cylinder, i, -k4 * now.excess / k1)
            wish = k1 * summed + k2 * now.error + k3 * now.error_rate + k4 * now.excess
            rate = tracked.needed.rate[cylinder, i] - wish
            opened = open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            slope = beyond(now.error, zone / now.scale)
            carry_on(memory, cylinder, i, summed, slope, constants.period, opened)
    return 0


@register(
    controller="lqr",
    about="A linear regulator on the motion that the spring would make; its gains weigh error against effort.",
    needs={"force sensor"},
    order=31,
)
class LinearQuadratic(TrackingController):
    """LQR with integral action about the compliant motion (this module).

    Arguments are those of ``TrackingController``, with the gains integral_tolerance (m s), position_tolerance (m),
    speed_tolerance (m/s) and force_tolerance (N): what counts as much as a force that changes by ``RATE_TOLERANCE``;
    friction_fraction; dead_zone.
    """

    LAW, CONSTANTS = staticmethod(control), Constants
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "integral_tolerance": (1e-6, 1e-3, 1.496e-05, 2.01e-05),
        "position_tolerance": (3e-4, 1e-1, 0.01156, 0.002392),
        "speed_tolerance": (1e-2, 3.0, 0.5829, 1.152),
        "force_tolerance": (1.0, 100.0, 2.826, 1.959),
        "friction_fraction": (0.0, 1.0, 0.3522, 0.7203),
        "dead_zone": (0.0, 5e-4, 3.35e-05, 0.0001414),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, Any]:
        mass, tolerances = self.parameters.mechanics.mass, np.array([gains[name] for name in list(self.GAINS)[:4]])
        low, high = kappa_range(self.parameters)
        grid = np.linspace(low, high, SCHEDULE)
        first = [regulator(mass, self.parameters.cylinder1.viscous_friction, kappa, tolerances) for kappa in grid]
        second = regulator(mass, self.parameters.cylinder2.viscous_friction, 1.0, tolerances)
        table = np.concatenate([np.array(first).T, np.repeat(second[:, None], SCHEDULE, axis=1)])
        # Six digits, which every processor's LAPACK gives alike.
        rounded = np.array([float(f"{gain:.6g}") for gain in table.flat])
        scheduled = {"lowest": low, "step": float(grid[1] - grid[0]), "table": rounded}
        return {**scheduled, "dead_zone": gains["dead_zone"], "pneumatic_gain": PNEUMATIC_GAIN}
