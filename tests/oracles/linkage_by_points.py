"""The linkage as points in the plane, in plain vector algebra: what the closed formulas of the package are compared with.

Nothing of the package is imported. O1 is the origin; a beam (cylinder 2) turns about it and carries the end effector at
distance r2; cylinder 1 runs from O3 = d3 (cos gamma3, sin gamma3) to the point A of the beam at distance d6. Vectors are
arrays (2, ...).
"""

from typing import Any, NamedTuple

import numpy as np


class Pose(NamedTuple):
    """Points and directions of the linkage: ``beam`` and ``rod`` are unit vectors along cylinders 2 and 1."""

    end_effector: Any
    attachment: Any
    pivot: Any
    beam: Any
    across: Any
    rod: Any
    lever: Any


def cross(a: Any, b: Any) -> Any:
    """The out-of-plane component of a x b."""
    return a[0] * b[1] - a[1] * b[0]


def turned_left(a: Any) -> Any:
    """``a`` turned by +90 degrees."""
    return np.stack([-a[1], a[0]])


def _pose(beam: Any, r2: Any, geometry: Any) -> Pose:
    pivot = geometry.d3 * np.array([np.cos(geometry.gamma3), np.sin(geometry.gamma3)])
    pivot = np.broadcast_to(pivot.reshape(2, *[1] * (np.ndim(beam) - 1)), np.shape(beam))
    attachment = geometry.d6 * beam
    rod = (attachment - pivot) / np.hypot(*(attachment - pivot))
    return Pose(r2 * beam, attachment, pivot, beam, turned_left(beam), rod, cross(attachment, rod))


def pose_from_lengths(r4: Any, r2: Any, geometry: Any) -> Pose:
    """Where two circles meet: radius d6 about O1 and r4 about O3, on the clockwise side of the line O1 O3."""
    r4, r2 = np.asarray(r4, dtype=float), np.asarray(r2, dtype=float)
    along = (geometry.d6**2 - r4**2 + geometry.d3**2) / (2 * geometry.d3)
    aside = np.sqrt(geometry.d6**2 - along**2)
    c, s = np.cos(geometry.gamma3), np.sin(geometry.gamma3)
    attachment = np.stack([along * c + aside * s, along * s - aside * c])
    return _pose(attachment / geometry.d6, r2, geometry)


def pose_from_point(point: Any, geometry: Any) -> Pose:
    """The linkage whose end effector is at ``point`` (2, ...)."""
    point = np.asarray(point, dtype=float)
    r2 = np.hypot(point[0], point[1])
    return _pose(point / r2, r2, geometry)


def lengths(pose: Pose) -> tuple[Any, Any]:
    """(r4, r2): distance A O3 and distance of the end effector from O1."""
    return np.hypot(*(pose.attachment - pose.pivot)), np.hypot(*pose.end_effector)


def cartesian_velocity(pose: Pose, r2: Any, v1: Any, v2: Any) -> tuple[Any, Any]:
    """Velocity of the end effector and turning rate of the beam, from the speeds of both rods."""
    d6 = np.hypot(*pose.attachment)
    turning = v1 / (d6 * (pose.across * pose.rod).sum(axis=0))
    return v2 * pose.beam + r2 * turning * pose.across, turning


def cartesian_acceleration(pose: Pose, r4: Any, r2: Any, v1: Any, v2: Any, a1: Any, a2: Any) -> Any:
    """Acceleration of the end effector, from r4^2 = |A - O3|^2 differentiated twice."""
    d6 = np.hypot(*pose.attachment)
    _, turning = cartesian_velocity(pose, r2, v1, v2)
    rod = pose.attachment - pose.pivot
    speed_a = d6 * turning * pose.across
    toward_centre = -d6 * turning**2 * pose.beam
    known = v1**2 + r4 * a1 - (speed_a**2).sum(axis=0) - (rod * toward_centre).sum(axis=0)
    spin = known / (d6 * (rod * pose.across).sum(axis=0))
    return (a2 - r2 * turning**2) * pose.beam + (2 * v2 * turning + r2 * spin) * pose.across


def newton_force(pose: Pose, r2: Any, force1: Any, force2: Any) -> Any:
    """Force on the end effector from forces along both rods: a massless beam passes on cylinder 1's torque about O1."""
    return force2 * pose.beam + force1 * pose.lever / r2 * pose.across
