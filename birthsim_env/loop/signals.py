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
    """What a controller is asked to do at one instant. ``rows`` is (15, N) or (15,); ``command`` refuses other shapes."""

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
    """What the sensors say at one instant, SI units.

    ``position`` (2, N) of the end effector was taken at ``position_time`` (N,), at or before ``time`` (N,). ``velocity``
    (2, N) is measured, or, where ``sampled`` is True, only the low-passed difference of rare and late position samples, which
    a controller will want to replace by an observer of its own. ``pressures`` (4, N) are those of chambers P1, N1, P2, N2,
    absolute. ``user_force`` (2, N) is that of a force sensor at the end effector. ``acceleration`` (2, N) is that of a sensor
    there; None without one.
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
