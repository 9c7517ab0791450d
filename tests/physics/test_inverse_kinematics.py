"""Positions to jerks of the pistons along moving targets, against mpmath's derivatives of the distances between points."""

import mpmath
import numpy as np

from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion, piston_reference
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import linkage_by_points as by_points
from tests.oracles import rigid_body
from tests.physics.rigs import each_rig


def piston_lengths(x: mpmath.mpf, y: mpmath.mpf, rig: Parameters) -> tuple[mpmath.mpf, mpmath.mpf]:
    """(y1, y2): distances of O3 from the point at d6 along the beam, and of the end effector from O1, less k1 and k2."""
    g = rig.geometry
    r2 = mpmath.hypot(x, y)
    ox, oy = g.d3 * mpmath.cos(g.gamma3), g.d3 * mpmath.sin(g.gamma3)
    return mpmath.hypot(g.d6 * x / r2 - ox, g.d6 * y / r2 - oy) - g.k1, r2 - g.k2


def points(rig: Parameters, lanes: int, rng: np.random.Generator) -> Array:
    """End effector positions spread over both strokes."""
    return rigid_body.pose_of(rng.uniform([[-0.095], [-0.19]], [[0.095], [0.19]], (2, lanes)), rig).end_effector


@each_rig
def test_piston_reference_is_the_inverse_geometry_and_its_three_derivatives(rig: Parameters) -> None:
    """Targets x(t), y(t) = c0 + c1 t + c2 t^2/2 + c3 t^3/6, differentiated at t = 0 with 60 digits."""
    rng = np.random.default_rng(0)
    target = np.empty((8, 25))
    target[:2] = points(rig, 25, rng)
    target[2:] = rng.normal(0, np.array([1, 1, 8, 8, 80, 80])[:, None], (6, 25))
    joints = np.empty((8, 25))
    piston_reference(target, Rig(parameter_column(rig)), joints, target.shape[1])
    with mpmath.workdps(60):
        for lane in range(25):
            x, y = ([mpmath.mpf(c) for c in target[axis::2, lane]] for axis in (0, 1))

            def piston(t: mpmath.mpf, which: int, x: list[mpmath.mpf] = x, y: list[mpmath.mpf] = y) -> mpmath.mpf:
                along = [sum(c[k] * t**k / mpmath.factorial(k) for k in range(4)) for c in (x, y)]
                return piston_lengths(*along, rig)[which]

            for which in (0, 1):
                truth = [float(mpmath.diff(lambda t, w=which: piston(t, w), 0, order)) for order in range(4)]
                # A rounding of the whole derivative: its terms may cancel, so the scale is that of the terms.
                scale = np.array([1.0, 1.0, 10.0, 100.0]) + np.abs(truth)
                np.testing.assert_array_less(np.abs(joints[which::2, lane] - truth), 1e-11 * scale)


@each_rig
def test_piston_motion_by_points(rig: Parameters) -> None:
    """Velocity of the linkage made of points, without the package's direct model."""
    rng = np.random.default_rng(3)
    piston, speed = rng.uniform([[-0.099], [-0.199]], [[0.099], [0.199]], (2, 200)), rng.uniform(-2, 2, (2, 200))
    pose = rigid_body.pose_of(piston, rig)
    velocity, _ = by_points.cartesian_velocity(pose, piston[1] + rig.geometry.k2, *speed)
    joints = np.empty((4, 200))
    piston_motion(np.concatenate([pose.end_effector, velocity]), Rig(parameter_column(rig)), joints, 200)
    np.testing.assert_allclose(joints, [*piston, *speed], rtol=0, atol=1e-12)
