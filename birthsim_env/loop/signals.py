"""What crosses the line between rig and controller: measurements one way, references the other.

Arrays are (rows, N) over N lanes. Everything also works for one rig without the lane axis, (rows,).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows


def displacement(force_x: Any, force_y: Any, kx: Any, ky: Any, kxy: Any) -> tuple[Any, Any]:
    """Displacement (m) of a spring [[kx, kxy], [kxy, ky]] (N/m) under a force (N)."""
    determinant = kx * ky - kxy * kxy
    return (ky * force_x - kxy * force_y) / determinant, (kx * force_y - kxy * force_x) / determinant


compliance = helper(displacement)
"""``displacement`` for kernels."""


class InPlane(Rows):
    """A vector in the plane."""

    x = row("SI", "x")
    y = row("SI", "y")


class PerPiston(Rows):
    """What pistons 1 and 2 have one each of."""

    first = row("SI", "of piston 1")
    second = row("SI", "of piston 2")


class PerChamber(Rows):
    """What chambers have one each of."""

    p1 = row("SI", "of chamber P1")
    n1 = row("SI", "of chamber N1")
    p2 = row("SI", "of chamber P2")
    n2 = row("SI", "of chamber N2")


class Point(Rows):
    """Where a point is."""

    position = rows("x y", "m", "position")
    velocity = rows("vx vy", "m/s", "velocity")


class Motion(Point):
    """How the end effector should move."""

    acceleration = rows("ax ay", "m/s2", "acceleration")
    jerk = rows("jx jy", "m/s3", "jerk")


class Joints(Rows):
    """Where the pistons are, measured or estimated."""

    position = rows("y1 y2", "m", "position")
    speed = rows("v1 v2", "m/s", "speed")


class Setpoints(Rows):
    """How stiff the rig should be."""

    stiffness = rows("Kclx Kcly", "N/m", "setpoint of closed-loop stiffness")
    pneumatic_stiffness = rows("Kpneu1 Kpneu2", "N/m", "setpoint of the pneumatic stiffness (9) of a cylinder")
    pneumatic_stiffness_rate = rows("dKpneu1 dKpneu2", "N/(m s)", "rate of that setpoint")
    stiffness_coupling = row("N/m", "what couples x and y: closed-loop stiffness is [[Kclx, Kclxy], [Kclxy, Kcly]]", "Kclxy")


class Reference(Motion, Setpoints):
    """What a controller is asked to do at one instant.

    Parameters
    ----------
    rows : array, (15, N) or (15,)
        SI units. Rows 0 to 7 are the target's ``position`` (x, y), m, ``velocity``, ``acceleration`` and ``jerk``; 8 and 9 are
        ``stiffness``, the setpoints Kclx, Kcly, N/m; 10 to 13 are ``pneumatic_stiffness`` of cylinders 1 and 2, N/m, and
        ``pneumatic_stiffness_rate``, N/(m s); 14 is ``stiffness_coupling``, Kclxy, N/m. Each is an attribute, a view.

    Notes
    -----
    The closed-loop stiffness asked for is [[Kclx, Kclxy], [Kclxy, Kcly]]; ``compliant_target`` is (19) of Herzig et al., IROS
    2015, doi 10.1109/IROS.2015.7353583.

    Examples
    --------
    A hand that pushes with 20 N along x against 2000 N/m finds the end effector 10 mm further:

    >>> import numpy as np, birthsim
    >>> reference = birthsim.Reference(np.zeros((15, 1)))
    >>> reference.position[:, 0], reference.stiffness[:, 0] = (0.5, 0.0), (2000.0, 2000.0)
    >>> reference.compliant_target(np.array([[20.0], [0.0]])).tolist()
    [[0.51], [0.0]]
    """

    def __init__(self, rows: Array) -> None:
        self.rows = rows

    def compliant_target(self, user_force: Array) -> Array:
        """Where a hand that pushes with ``user_force`` (2, N), N, should find the end effector (19), m, (2, N)."""
        (kx, ky), kxy = self.stiffness, self.stiffness_coupling
        x, y = displacement(user_force[0], user_force[1], kx, ky, kxy)
        return np.asarray(self.position + np.stack([x, y]))


@helper
def compliant_offset(reference: Reference, fx: float, fy: float, i: int) -> tuple[float, float]:
    """What a force, N, displaces the compliant target of lane ``i`` by (19), m."""
    kx, ky, kxy = reference.stiffness[0, i], reference.stiffness[1, i], reference.stiffness_coupling[i]
    return compliance(fx, fy, kx, ky, kxy)


REFERENCE_NAMES = tuple(name for name, *_ in Reference.entries())
REFERENCES = Reference.size


@dataclass(frozen=True)
class Measurement:
    """What the sensors say at one instant, over N lanes; without the lane axis, (2,) and (4,), for one rig.

    Parameters
    ----------
    time : array, (N,)
        s since the episode began.
    position : array, (2, N)
        Of the end effector, x and y, m.
    position_time : array, (N,)
        When the position was taken, s, at or before ``time``.
    velocity : array, (2, N)
        Of the end effector, m/s: measured, or, where ``sampled`` is True, only the low-passed difference of rare and late
        samples of the position, which a controller will want to replace by an observer of its own.
    pressures : array, (4, N)
        Of chambers P1, N1, P2, N2, Pa absolute.
    user_force : array, (2, N)
        Of the hand, as a force sensor at the end effector has it, N.
    sampled : bool
        Whether positions are samples of a tracker.
    acceleration : array, (2, N), or None
        Of the end effector, as a sensor there has it, m/s2; None without one.

    Examples
    --------
    >>> import birthsim
    >>> worlds = birthsim.make_vec("BirthSIM/Probe-v3", num_envs=3, sensors="lab")
    >>> observations, infos = worlds.reset(seed=0)
    >>> measured = worlds.measurement
    >>> measured.pressures.shape, measured.sampled, measured.acceleration
    ((4, 3), True, None)
    """

    time: Array
    position: Array
    position_time: Array
    velocity: Array
    pressures: Array
    user_force: Array
    sampled: bool
    acceleration: Array | None = None


Mask = NDArray[np.bool_]
