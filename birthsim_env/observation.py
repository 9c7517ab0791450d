"""What a policy sees: one kernel computes it, one table names and scales every entry.

All entries come from measurements (noisy and late with ``lab`` sensors).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Signals, fill_measurement
from birthsim_env.loop.signals import Joints, Measurement, Point, Reference, compliant_offset
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import control_model
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import FREE, Array, Rig
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.parameters import Parameters

LIMIT = 10.0
"""Bound of every observation entry, in units of its scale."""


@dataclass(frozen=True)
class Entry:
    """One entry of the observation: what it is, its unit and the value that maps to 1."""

    name: str
    unit: str
    scale: float

    def __str__(self) -> str:
        return f"{self.name}, {self.scale:g} {self.unit}"


class Observation(Rows):
    """What a policy sees of the rig, before it is scaled."""

    error = rows("x y", "m", "tracking error {} (end effector - compliant target)")
    velocity = rows("x y", "m/s", "end effector velocity {}")
    piston = rows("y1 y2", "half strokes", "piston position {}")
    force = rows("1 2", "N", "force on piston {} (F - Fext + user force (17))")
    pneumatic_stiffness = rows("1 2", "N/m", "pneumatic stiffness of cylinder {}")
    pneumatic_setpoint = rows("1 2", "N/m", "pneumatic stiffness setpoint of cylinder {}")
    stiffness = rows("x y", "N/m", "closed-loop stiffness setpoint {}")
    user_force = rows("x y", "N", "user force {}")
    target_velocity = rows("x y", "m/s", "target velocity {}")
    target_acceleration = rows("x y", "m/s2", "target acceleration {}")


_PAIRS = (0.01, 0.01), (0.2, 0.2), (1.0, 1.0), (200.0, 200.0), (5000.0, 2500.0), (5000.0, 2500.0)
SCALES = np.array((*_PAIRS, (5000.0, 5000.0), (50.0, 50.0), (0.2, 0.2), (0.5, 0.5))).ravel()
ENTRIES = tuple(
    Entry(about.format(name), unit, scale) for (name, unit, about, _), scale in zip(Observation.entries(), SCALES, strict=True)
)
SIZE = len(ENTRIES)

PER_CYLINDER = (Observation.piston, Observation.force, Observation.pneumatic_stiffness, Observation.pneumatic_setpoint)
FIRST_PER_CYLINDER, AFTER_PER_CYLINDER = PER_CYLINDER[0].first, PER_CYLINDER[-1].first + 2
STIFFNESS = Observation.stiffness.first
"""Rows that pistons have one each of, which are neighbours, and those of the closed-loop stiffness; all others are vectors."""


def entries_of(rig: Parameters) -> tuple[Entry, ...]:
    """What a policy sees of a rig: on a rail one entry of each pair, along it or of its cylinder."""
    if not rig.linkage.is_rail:
        return ENTRIES
    named = [(k, *entry) for k, entry in enumerate(Observation.entries())][1::2]
    names = (
        (k, name if FIRST_PER_CYLINDER <= k < AFTER_PER_CYLINDER else "along the rail", about) for k, name, _, about, _ in named
    )
    return tuple(Entry(about.format(name), ENTRIES[k].unit, ENTRIES[k].scale) for k, name, about in names)


def size_of(nominal: Array) -> int:
    """Number of ``entries_of`` a rig with parameters (PARAMETERS,)."""
    return SIZE if nominal[FREE] > 0.0 else SIZE // 2


@helper
def _of_rail(pair: Array, k: int, p: Rig) -> float:
    """What a rail has of the rows ``k`` and k + 1, a ``pair``: that along it, or of its cylinder."""
    cosine, sine = p.sin_gamma3, -p.cos_gamma3  # of the inclination
    first, second = (cosine * cosine, sine * sine) if k == STIFFNESS else (cosine, sine)
    per_cylinder = FIRST_PER_CYLINDER <= k < AFTER_PER_CYLINDER
    return float(pair[1] if per_cylinder else first * pair[0] + second * pair[1])


@helper
def look(seen: Signals, action: Array, shown: Array, p: Rig, scales: Array, out: NDArray[np.float32], n: int) -> None:
    """Writes observations of n lanes, ``out`` (N, SIZE + M + S), see ``observe``; then ``action`` (M, N), ``shown`` (S, N)."""
    point, joints, reference = Point(scratch(Point.size)), Joints(scratch(Joints.size)), seen.reference
    own = Observation(scratch(Observation.size)[:, 0])
    for i in range(n):
        for axis in range(2):
            point.position[axis, 0], point.velocity[axis, 0] = seen.position[axis, i], seen.velocity[axis, i]
        piston_motion(point.rows, p, joints.rows, 1)
        y1, y2 = joints.position[0, 0], joints.position[1, 0]
        pp1, pn1 = seen.pressure[0, i], seen.pressure[1, i]
        pp2, pn2 = seen.pressure[2, i], seen.pressure[3, i]
        half1, half2 = p.half_l1, p.half_l2
        edge1, edge2 = 0.02 * half1, 0.02 * half2
        fx, fy = seen.user_force[0, i], seen.user_force[1, i]
        given = compliant_offset(reference, fx, fy, i)
        for axis in range(2):
            own.error[axis] = seen.position[axis, i] - reference.position[axis, i] - given[axis]
            own.velocity[axis] = seen.velocity[axis, i]
            own.pneumatic_setpoint[axis] = reference.pneumatic_stiffness[axis, i]
            own.stiffness[axis] = reference.stiffness[axis, i]
            own.user_force[axis] = seen.user_force[axis, i]
            own.target_velocity[axis] = reference.velocity[axis, i]
            own.target_acceleration[axis] = reference.acceleration[axis, i]
        own.piston[0], own.piston[1] = y1 / half1, y2 / half2
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        # Pressures and hand together: what is left to hold them in balance is weight and friction, whatever the hand does.
        pressed1 = mechanics.piston_force(pp1, pn1, p.area_p1, p.area_n1, p.atmosphere)
        pressed2 = mechanics.piston_force(pp2, pn2, p.area_p2, p.area_n2, p.atmosphere)
        own.force[0] = pressed1 + mechanics.user_force1(fx, fy, kappa, sine, cosine)
        own.force[1] = pressed2 + mechanics.user_force2(fx, fy, sine, cosine)
        own.pneumatic_stiffness[0] = control_model.pneumatic_stiffness(
            pp1, pn1, p.area_p1, p.area_n1, max(half1 + y1, edge1), max(half1 - y1, edge1), p.index
        )
        own.pneumatic_stiffness[1] = control_model.pneumatic_stiffness(
            pp2, pn2, p.area_p2, p.area_n2, max(half2 + y2, edge2), max(half2 - y2, edge2), p.index
        )
        each = 1 if p.free > 0.0 else 2
        size = scales.shape[0] // each
        for k in range(size):
            value = own.rows[k] if each == 1 else _of_rail(own.rows[2 * k : 2 * k + 2], 2 * k, p)
            out[i, k] = max(-LIMIT, min(LIMIT, value / scales[each * k + each - 1]))
        for k in range(action.shape[0]):
            out[i, size + k] = action[k, i]
        for k in range(shown.shape[0]):
            out[i, size + action.shape[0] + k] = shown[k, i]


def observe(measurement: Measurement, reference: Reference, beside: Array, nominal: Array) -> NDArray[np.float32]:
    """Observations (N, SIZE + M): ``ENTRIES`` over their scales, clipped to +-LIMIT, then what stands beside them.

    ``beside`` (M, N): the last action, and what an actuation remembers; ``nominal`` (PARAMETERS,) is the rig as its owner
    describes it: a policy does not know what randomisation drew.
    """
    lanes, size = beside.shape[1], size_of(nominal)
    out, seen = np.empty((lanes, size + beside.shape[0]), dtype=np.float32), Signals(np.zeros((Signals.size, lanes)))
    fill_measurement(seen.rows, measurement)
    seen.reference.rows[:] = reference.rows
    look(seen, beside, np.empty((0, lanes)), Rig(nominal), SCALES, out, lanes)
    return out
