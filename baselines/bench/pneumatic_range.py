"""Which pneumatic stiffness a cylinder can have while it holds a load: pressures lie between atmosphere and supply."""

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, joint_force
from birthsim_env.physics.rig.parameters import Parameters


def pneumatic_range(position: Array, force: Array, rig: Parameters) -> tuple[Array, Array]:
    """Least and largest pneumatic stiffness (9) of cylinders 1 and 2, N/m, (2, N) each, at rest.

    ``position`` (2, N), m, of the end effector, which holds its weight and a hand's ``force`` (2, N), N, without the help of
    dry friction. The least exceeds the largest where the cylinder cannot hold that load at all. Raises ``ValueError`` for
    positions outside the workspace.
    """
    piston = inverse_geometry(position, rig)
    load = force + np.array([[0.0], [-rig.mechanics.mass * rig.mechanics.gravity]])
    low, high = rig.air.atmospheric_pressure, rig.air.supply_pressure
    bounds = []
    for cylinder, y, pushed in zip((rig.cylinder1, rig.cylinder2), piston, joint_force(load, piston, rig), strict=True):
        force_wanted = low * (cylinder.area_p - cylinder.area_n) - pushed
        # With F = a - b, where a = Pp Sp and b = Pn Sn, both chambers' limits are limits of a.
        least = np.maximum(low * cylinder.area_p, low * cylinder.area_n + force_wanted)
        most = np.minimum(high * cylinder.area_p, high * cylinder.area_n + force_wanted)
        length_p, length_n = cylinder.stroke / 2 + y, cylinder.stroke / 2 - y
        bounds.append([rig.air.polytropic_index * (a / length_p + (a - force_wanted) / length_n) for a in (least, most)])
    return np.array([bound[0] for bound in bounds]), np.array([bound[1] for bound in bounds])


def pneumatic_setpoint(position: Array, moved: Array, force: Array, rig: Parameters) -> Array:
    """Setpoints (2, N), N/m, in the middle of what both ends of a push allow: rest at ``position`` (2, N), m, and ``force``
    (2, N), N, held ``moved`` (2, N), m, further on."""
    resting, pushed = pneumatic_range(position, 0 * force, rig), pneumatic_range(position + moved, force, rig)
    return np.asarray((np.maximum(resting[0], pushed[0]) + np.minimum(resting[1], pushed[1])) / 2)
