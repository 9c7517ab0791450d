"""What the backstepping laws render to a hand, to the second order in s.

Both laws give a hand the impedance (see ``gains`` and ``cartesian_law``; c are gains, phi = Fv/m_e)
    Z(s) = m_e (s^3 + a2 s^2 + a1 s + a0) / (s + a2 - phi) = K + B s + M s^2 + ...
    K = m_e a0 / (a2 - phi),   B = (m_e a1 - K) / (a2 - phi),   M = (m_e a2 - B) / (a2 - phi).
The paper's law has one such Z per piston, which the Jacobian (16) turns into J^-T diag(Z1, Z2) J^-1. The Cartesian law has
matrices in the place of numbers. Above (a2 - phi)/2 pi, 15 Hz and more from 2000 N/m on, the rest of the series counts.
"""

import math

import numpy as np

from baselines.backstepping.gains import gains_for
from baselines.impedance import Impedance, matrix_root, stiffness_matrix
from birthsim_env.loop.guard import require_good
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian
from birthsim_env.physics.rig.parameters import Parameters


def joint_impedance(c: tuple[float, float, float], apparent_mass: float, viscous: float) -> tuple[float, float, float]:
    """M (kg), B (N s/m) and K (N/m) of one piston with gains c1, c2, c3 (1/s), apparent mass (kg), viscous friction (N s/m)."""
    a2, a0 = sum(c), c[0] + c[2] + c[0] * c[1] * c[2]
    a1 = c[0] * c[1] + c[0] * c[2] + c[1] * c[2] + 2.0
    pole = a2 - viscous / apparent_mass
    stiffness = apparent_mass * a0 / pole
    damping = (apparent_mass * a1 - stiffness) / pole
    return (apparent_mass * a2 - damping) / pole, damping, stiffness


def paper_impedance(reference: Reference, rig: Parameters, damping_ratio: float | None) -> Impedance:
    """The impedance of the paper's law at the reference pose, with (18) between Cartesian and joint setpoints.

    ``damping_ratio`` as in ``BacksteppingController``. Raises ``ValueError`` for setpoints without positive gains and for a
    pose outside the workspace.
    """
    require_good(reference)
    columns = jacobian(inverse_geometry(reference.position, rig), rig)
    lanes = columns.shape[2]
    joints = np.empty((3, 2, lanes))
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        squares = columns[:, i] ** 2
        for lane in range(lanes):
            stiffness = float(reference.stiffness[:, lane] @ squares[:, lane])
            apparent_mass = float(rig.mechanics.mass * squares[:, lane].sum())
            damping = None if damping_ratio is None else 2.0 * damping_ratio * math.sqrt(stiffness * apparent_mass)
            gains = gains_for(stiffness, apparent_mass, cylinder.viscous_friction, damping)
            joints[:, i, lane] = joint_impedance(gains, apparent_mass, cylinder.viscous_friction)
    return Impedance(*(_turned(diagonal, columns) for diagonal in joints))


def cartesian_impedance(reference: Reference, rig: Parameters) -> Impedance:
    """The impedance of ``cartesian_law`` at the reference pose: (s + 3 C - D/m) on the left of Z, with the matrices there.

    Raises ``ValueError`` for a pose outside the workspace.
    """
    require_good(reference)
    mass, columns = rig.mechanics.mass, jacobian(inverse_geometry(reference.position, rig), rig)
    viscous = np.array([rig.cylinder1.viscous_friction, rig.cylinder2.viscous_friction])
    drag = _turned(np.repeat(viscous[:, None], columns.shape[2], axis=1), columns)
    stiffness, one = stiffness_matrix(reference), np.eye(2)[:, :, None]
    c = matrix_root(3.0 * stiffness / mass - 2.0 * one)
    pole = np.linalg.inv((3.0 * c - drag / mass).transpose(2, 0, 1))
    # 3 C^2 + 2 = 9 K/m - 4.
    damping = np.einsum("nij,jkn->ikn", pole, 9.0 * stiffness - 4.0 * mass * one - stiffness)
    return Impedance(np.einsum("nij,jkn->ikn", pole, 3.0 * mass * c - damping), damping, stiffness)


def _turned(diagonal: Array, columns: Array) -> Array:
    """J^-T diag(d1, d2) J^-1, (2, 2, N), for joint values (2, N) and Jacobians (2, 2, N)."""
    inverse = np.linalg.inv(columns.transpose(2, 0, 1))
    return np.asarray(np.einsum("nki,kn,nkj->ijn", inverse, diagonal, inverse))
