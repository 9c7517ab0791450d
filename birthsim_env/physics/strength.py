"""What the cylinders can bear: chambers between atmosphere and supply push with (Ps - Pa) Sp and pull with (Ps - Pa) Sn."""

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, joint_force
from birthsim_env.physics.rig.parameters import Parameters


def carried(position: Array, rig: Parameters) -> Array:
    """Share (2, N) of what cylinders 1 and 2 can bear that the weight asks for with the end effector at ``position`` (2, N), m.

    Raises ``ValueError`` for positions outside the workspace.
    """
    weight = np.zeros_like(position)
    weight[1] = rig.mechanics.mass * rig.mechanics.gravity
    needed = joint_force(weight, inverse_geometry(position, rig), rig)
    spare = rig.air.supply_pressure - rig.air.atmospheric_pressure
    cylinders = (rig.cylinder1, rig.cylinder2)
    strength = spare * np.array([[one.area_p, one.area_n] for one in cylinders])
    return np.stack([np.maximum(needed[k] / strength[k, 0], -needed[k] / strength[k, 1]) for k in range(2)])


def require_carried(position: Array, rig: Parameters) -> None:
    """Raises ``ValueError`` for a rig that can hold its own weight at none of the positions (2, N), m; a rail bears what is
    across it."""
    cylinders = rig.linkage.topology.cylinders
    fractions = carried(position, rig)[list(cylinders)]
    lane = int(fractions.max(axis=0).argmin())
    cylinder = cylinders[int(fractions[:, lane].argmax())]
    fraction = float(fractions[:, lane].max())
    if fraction > 1.0:
        x, y = position[:, lane]
        mass = rig.mechanics.mass
        raise ValueError(
            f"Mechanics.mass = {mass:g} kg is more than this rig can carry: at ({x:.3g}, {y:.3g}) m its weight asks for "
            f"{100 * fraction:.0f} % of what cylinder {cylinder + 1} can bear; allowed: less than {mass / fraction:.3g} kg "
            "there, or a larger bore or supply pressure"
        )
