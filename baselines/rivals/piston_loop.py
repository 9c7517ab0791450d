"""What a law that commands a force rate sees of a piston, and how valves carry that rate out.

By (5) and (10) the error e = y - yd of a piston beside the motion that it follows obeys, to first order,
    d2e/dt2 = D/m_e + d,   dD/dt = u - dF*/dt,   D = F - F*,
where m_e is the apparent mass (m kappa^2 of cylinder 1, m of cylinder 2), F* the force that the motion needs, u the commanded
dF/dt, and d all that the model lacks: friction beyond what F* has of it, wrong mass and weight, pushes that no sensor saw.
"""

from typing import NamedTuple

from baselines.rivals.feedforward import Tracking
from baselines.valve_inverse import CylinderAir, air_at, stiffness_of, two_valve_openings
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Rig


class PistonError(NamedTuple):
    """A piston beside its motion."""

    scale: float
    """What a length or a speed of the piston is at the end effector: kappa of cylinder 1, 1 of cylinder 2."""
    mass: float
    """m_e, kg."""
    error: float
    """e, m."""
    error_rate: float
    """de/dt, m/s."""
    excess: float
    """D, N."""
    air: CylinderAir


@helper
def piston_error(tracked: Tracking, seen: Seen, cylinder: int, i: int, p: Rig) -> PistonError:
    """Of lane ``i`` and ``cylinder`` 0 or 1."""
    row = 2 * cylinder
    y, v = tracked.joints.position[cylinder, i], tracked.joints.speed[cylinder, i]
    air = air_at(cylinder, seen.pressure[row, i], seen.pressure[row + 1, i], y, v, p)
    scale = tracked.needed.kappa[i] if cylinder == 0 else 1.0
    return PistonError(
        scale,
        p.mass * scale * scale,
        y - tracked.wanted.position[cylinder, i],
        v - tracked.wanted.speed[cylinder, i],
        air.pp * air.ap - air.pn * air.an - tracked.needed.force[cylinder, i],
        air,
    )


@helper
def open_valves(seen: Seen, cylinder: int, i: int, rate: float, c4: float, air: CylinderAir, p: Rig) -> tuple[float, float]:
    """Writes and returns the openings that give dF/dt = ``rate``, N/s, and let the pneumatic stiffness tend to its setpoint at
    c4, as the paper's law does."""
    away = stiffness_of(air, p) - seen.asked.pneumatic_stiffness[cylinder, i]
    opened = two_valve_openings(rate, seen.asked.pneumatic_stiffness_rate[cylinder, i] - c4 * away, air, p)
    seen.opening[2 * cylinder, i], seen.opening[2 * cylinder + 1, i] = opened
    return opened
