"""Joint stiffness from Cartesian setpoints (18) and the duality of forces (17), with a Jacobian that SymPy derives itself."""

from functools import cache

import numpy as np
import sympy as sp

from baselines.backstepping.cartesian_stiffness import joint_stiffness1, joint_stiffness2
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import linkage_by_points as by_points

D3, D6, R4, R2 = sp.symbols("d3 d6 r4 r2", positive=True)
GAMMA3, FX, FY, ANGLE = sp.symbols("gamma3 Fx Fy theta1", real=True)
KX, KY = sp.symbols("Kclx Kcly", positive=True)
W = R4**2 - D3**2 - D6**2
THETA = GAMMA3 - sp.asin(W / (2 * D3 * D6))
"""(1)."""
KAPPA = 2 * R2 * R4 / sp.sqrt(4 * D3**2 * D6**2 - W**2)


@cache
def jacobian() -> sp.Matrix:
    """(16), by differentiation of xc = r2 sin(theta1), yc = -r2 cos(theta1)."""
    return sp.Matrix([R2 * sp.sin(THETA), -R2 * sp.cos(THETA)]).jacobian([R4, R2])


def vanishes(expression: sp.Expr) -> bool:
    """At any angle."""
    return bool(sp.simplify(sp.nsimplify(expression.subs(THETA, ANGLE), rational=True)) == 0)


def test_joint_stiffness_18_is_the_diagonal_of_the_quadratic_form() -> None:
    quadratic = jacobian().T * sp.diag(KX, KY) * jacobian()
    sine, cosine = sp.sin(THETA), sp.cos(THETA)
    assert vanishes(joint_stiffness1.py_func(KX, KY, KAPPA, sine, cosine) - quadratic[0, 0])
    assert vanishes(joint_stiffness2.py_func(KX, KY, sine, cosine) - quadratic[1, 1])


def test_equal_setpoints_do_not_couple_the_cylinders() -> None:
    """The columns of J are orthogonal, so nothing is lost by (18); unequal setpoints couple by kappa sin(2 theta1)/2."""
    quadratic = jacobian().T * sp.diag(KX, KY) * jacobian()
    assert vanishes(quadratic[0, 1].subs(KY, KX))
    assert vanishes(quadratic[0, 1] - KAPPA * sp.sin(THETA) * sp.cos(THETA) * (KY - KX))


def test_equal_setpoints_are_rendered_in_every_direction() -> None:
    """A force F moves the joints by J^T F / Kcl, and so the end effector by F / Kcl, without a component across."""
    force, equal = sp.Matrix([FX, FY]), {KY: KX}
    joint = [
        joint_stiffness1.py_func(KX, KX, KAPPA, sp.sin(THETA), sp.cos(THETA)),
        joint_stiffness2.py_func(KX, KX, sp.sin(THETA), sp.cos(THETA)),
    ]
    given_way = jacobian() * sp.diag(*(1 / k for k in joint)) * jacobian().T * force
    assert all(vanishes(moved - pushed / KX) for moved, pushed in zip(given_way.subs(equal), force, strict=True))


def test_force_duality_17() -> None:
    """Forces along the cylinders do the work of the user's force: (J^T F) . dq = F . (J dq) for all dq."""
    v1, v2 = sp.symbols("v1 v2", real=True)
    sine, cosine = sp.sin(THETA), sp.cos(THETA)
    along1 = mechanics.user_force1.py_func(FX, FY, KAPPA, sine, cosine)
    along2 = mechanics.user_force2.py_func(FX, FY, sine, cosine)
    velocity = jacobian() * sp.Matrix([v1, v2])
    assert vanishes(along1 * v1 + along2 * v2 - FX * velocity[0] - FY * velocity[1])


def test_compiled_setpoints_and_forces_by_points() -> None:
    """Stiffness k of a spring along a unit joint motion u is k |u|^2, axis by axis: the helpers on the linkage of points."""
    rig, rng = Parameters().replace({"geometry.gamma3": 1.3}), np.random.default_rng(0)
    y1, y2 = rng.uniform([[-0.099], [-0.199]], [[0.099], [0.199]], (2, 100))
    r4, r2 = y1 + rig.geometry.k1, y2 + rig.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, rig.geometry)
    column1, _ = by_points.cartesian_velocity(pose, r2, 1.0, 0.0)
    column2, _ = by_points.cartesian_velocity(pose, r2, 0.0, 1.0)
    force, stiffness = rng.uniform(-100, 100, (2, 100)), rng.uniform(500, 5000, (2, 100))
    sine, cosine = pose.beam[0], -pose.beam[1]
    kappa = np.hypot(*column1)
    got1 = [joint_stiffness1(*args) for args in zip(*stiffness, kappa, sine, cosine, strict=True)]
    got2 = [joint_stiffness2(*args) for args in zip(*stiffness, sine, cosine, strict=True)]
    np.testing.assert_allclose(got1, (stiffness * column1**2).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(got2, (stiffness * column2**2).sum(axis=0), rtol=1e-12)
    expected = np.stack([(force * column1).sum(axis=0), (force * column2).sum(axis=0)])
    np.testing.assert_allclose(geometry.joint_force(force, [y1, y2], rig), expected, rtol=0, atol=1e-10)
