"""Joint stiffness from Cartesian setpoints (18) on the linkage of points."""

import numpy as np

from baselines.backstepping.cartesian_stiffness import joint_stiffness1, joint_stiffness2
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import rigid_body


def test_joint_stiffness_18_is_the_diagonal_of_the_quadratic_form() -> None:
    """Stiffness k of a spring along a unit joint motion u is k |u|^2, axis by axis."""
    rig, rng = Parameters().replace({"geometry.gamma3": 1.3}), np.random.default_rng(0)
    piston = rng.uniform([[-0.099], [-0.199]], [[0.099], [0.199]], (2, 100))
    pose, (column1, column2) = rigid_body.pose_of(piston, rig), rigid_body.jacobians(piston, rig).T
    stiffness = rng.uniform(500, 5000, (2, 100))
    sine, cosine = pose.beam[0], -pose.beam[1]
    got1 = [joint_stiffness1(*args) for args in zip(*stiffness, np.hypot(*column1), sine, cosine, strict=True)]
    got2 = [joint_stiffness2(*args) for args in zip(*stiffness, sine, cosine, strict=True)]
    np.testing.assert_allclose(got1, (stiffness * column1**2).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(got2, (stiffness * column2**2).sum(axis=0), rtol=1e-12)
