"""The impedance that a law means to render: the mass, damping and stiffness that a hand should feel about the target."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.guard import require_good
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Impedance:
    """``M e'' + B e' + K e = Fu`` with e = x - xt: ``mass`` (kg), ``damping`` (N s/m) and ``stiffness`` (N/m), (2, 2, N) each.

    Rows and columns are x and y of the end effector; N counts lanes.
    """

    mass: Array
    damping: Array
    stiffness: Array

    def at(self, frequency: Array) -> Complex:
        """Z(jw) = K - w^2 M + j w B, N/m, (F, 2, 2, N), at frequencies (F,), Hz."""
        w = 2 * np.pi * np.asarray(frequency, dtype=np.float64)[:, None, None, None]
        return np.asarray(self.stiffness - w * w * self.mass + 1j * w * self.damping)

    def along(self, frequency: Array, direction: Array) -> Complex:
        """Force over displacement along it, N/m, (F, N), where the hand pushes along unit vectors ``direction`` (2, N)."""
        compliance = np.linalg.inv(self.at(frequency).transpose(0, 3, 1, 2))
        return np.asarray(1.0 / np.einsum("in,fnij,jn->fn", direction, compliance, direction))


@runtime_checkable
class StatesImpedance(Protocol):
    """A controller that knows what it renders."""

    def declared_impedance(self, reference: Reference) -> Impedance | None:
        """What the law means to render at ``reference`` (N lanes); None where it has nothing to declare."""
        ...


def declared_by(controller: Any, reference: Reference) -> Impedance | None:
    """The impedance that a controller declares for a ``reference`` over N lanes; None for one that states none."""
    return controller.declared_impedance(reference) if isinstance(controller, StatesImpedance) else None


def stiffness_matrix(reference: Reference) -> Array:
    """The setpoint [[Kclx, Kclxy], [Kclxy, Kcly]], N/m, (2, 2, N)."""
    (kx, ky), kxy = reference.stiffness, reference.stiffness_coupling
    return np.array([[kx, kxy], [kxy, ky]])


def matrix_root(matrix: Array) -> Array:
    """Square root of symmetric positive definite matrices (2, 2, N)."""
    root = np.sqrt(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
    trace = np.sqrt(matrix[0, 0] + matrix[1, 1] + 2.0 * root)
    return np.asarray((matrix + root * np.eye(2)[:, :, None]) / trace)


def mass_spring_damper(reference: Reference, mass: float | Array, damping_ratio: float) -> Impedance:
    """The impedance of ``baselines.estimation.admittance``: mass m (kg), one or (N,), the stiffness asked for, and the damping
    B = 2 zeta (m K)^(1/2)."""
    require_good(reference)
    stiffness = stiffness_matrix(reference)
    damping = 2.0 * damping_ratio * mass * matrix_root(stiffness / mass)
    return Impedance(np.broadcast_to(mass * np.eye(2)[:, :, None], stiffness.shape).copy(), damping, stiffness)


class DeclaredMotion:
    """Where an impedance would be under the true force of the hand, N lanes, which begin at rest on the target.

    ``offset`` (4, N): position (m) and velocity (m/s) from the target.
    """

    SUBSTEPS = 5
    """Of a policy step of 10 ms: Runge and Kutta's method of fourth order, whose error a mass of 3 kg at 5000 N/m has below
    1e-6 of the motion; assumed to be enough."""

    def __init__(self, lanes: int) -> None:
        self.offset: Array = np.zeros((4, lanes))

    def advance(self, impedance: Impedance, before: Array, after: Array, duration: float) -> None:
        """Go on by ``duration`` s, in which the force (2, N), N, changes evenly from ``before`` to ``after``."""
        inverse = np.linalg.inv(impedance.mass.transpose(2, 0, 1)).transpose(1, 2, 0)

        def rates(state: Array, force: Array) -> Array:
            own = np.einsum("ijn,jn->in", impedance.stiffness, state[:2])
            own += np.einsum("ijn,jn->in", impedance.damping, state[2:])
            return np.concatenate([state[2:], np.einsum("ijn,jn->in", inverse, force - own)])

        h, change, z = duration / self.SUBSTEPS, (after - before) / self.SUBSTEPS, self.offset
        for k in range(self.SUBSTEPS):
            force = before + k * change
            first = rates(z, force)
            second = rates(z + h / 2 * first, force + change / 2)
            third = rates(z + h / 2 * second, force + change / 2)
            fourth = rates(z + h * third, force + change)
            z = z + h / 6 * (first + 2 * second + 2 * third + fourth)
        self.offset = z
