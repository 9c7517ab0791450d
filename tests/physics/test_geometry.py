"""Geometry (1), (2), (16), (17): closed formulas against points in the plane."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env.physics.compiled.lanes import V1, V2, Y1, Y2
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Geometry, Parameters
from tests.oracles import linkage_by_points as by_points
from tests.oracles import rigid_body
from tests.physics.rigs import each_rig


def grid(rig: Parameters, steps: int = 31) -> np.ndarray:
    """Piston positions over both whole strokes, (2, steps, steps)."""
    half1, half2 = rig.cylinder1.stroke / 2, rig.cylinder2.stroke / 2
    return np.stack(np.meshgrid(np.linspace(-half1, half1, steps), np.linspace(-half2, half2, steps)))


@st.composite
def rigs(draw: st.DrawFn) -> Parameters:
    """Any linkage that ``Parameters`` accepts, up to the edges of its limits."""
    d3, d6 = draw(st.floats(0.28, 0.5)), draw(st.floats(0.2, 0.3))
    low, high = max(1.05 * abs(d3 - d6) + 0.1, 0.11), 0.98 * (d3 + d6) - 0.1
    k1 = low + (high - low) * draw(st.floats(0.001, 0.999))
    gamma3, k2 = draw(st.floats(-math.pi, math.pi)), draw(st.floats(0.23, 0.8))
    return Parameters(geometry=Geometry(d3=d3, d6=d6, gamma3=gamma3, k1=k1, k2=k2))


@given(rig=rigs(), fraction1=st.floats(-1, 1), fraction2=st.floats(-1, 1))
def test_direct_model_meets_both_circles_and_the_inverse_model_leads_back(
    rig: Parameters, fraction1: float, fraction2: float
) -> None:
    piston = np.array([fraction1 * rig.cylinder1.stroke / 2, fraction2 * rig.cylinder2.stroke / 2])
    point = geometry.end_effector(piston, rig)
    np.testing.assert_allclose(point, rigid_body.pose_of(piston, rig).end_effector, rtol=0, atol=1e-12)
    np.testing.assert_allclose(geometry.inverse_geometry(point, rig), piston, rtol=0, atol=1e-12)


@each_rig
def test_theta1_is_the_angle_from_straight_down(rig: Parameters) -> None:
    piston = grid(rig)
    x, y = rigid_body.pose_of(piston, rig).end_effector
    difference = geometry.theta1(piston[0], rig) - np.arctan2(x, -y)
    np.testing.assert_allclose(np.exp(1j * difference), 1, rtol=0, atol=1e-12)


@each_rig
def test_theta5_and_the_slip_of_the_paper(rig: Parameters) -> None:
    y1 = np.linspace(-0.1, 0.1, 41)
    p = rigid_body.pose_of(np.stack([y1, 0 * y1]), rig)
    to_o1, to_o3 = -p.attachment, p.pivot - p.attachment
    angle = np.arctan2(np.abs(by_points.cross(to_o1, to_o3)), (to_o1 * to_o3).sum(axis=0))
    np.testing.assert_allclose(geometry.theta5(y1, rig), math.pi / 2 - angle, rtol=0, atol=1e-12)
    g, r4 = rig.geometry, y1 + rig.geometry.k1
    printed = (r4**2 + g.d6**2 - g.d3**2) / (2 * g.d3 * r4)
    assert np.abs(printed - np.cos(angle)).max() > 0.05


@each_rig
def test_jacobian_and_joint_forces_are_those_of_points(rig: Parameters) -> None:
    """Columns are the velocities of the end effector per speed of each piston; forces do the same work."""
    piston = grid(rig, 9)
    columns = rigid_body.jacobians(piston.reshape(2, -1), rig)
    found = geometry.jacobian(piston, rig)
    np.testing.assert_allclose(found, np.moveaxis(columns, 0, -1).reshape(2, 2, 9, 9), rtol=0, atol=1e-12)
    force = np.random.default_rng(3).uniform(-200, 200, piston.shape)
    expected = np.einsum("ijkl,ikl->jkl", found, force)
    np.testing.assert_allclose(geometry.joint_force(force, piston, rig), expected, rtol=0, atol=1e-10)


def test_edges_of_the_workspace_are_named_rightly_and_reached_and_no_more() -> None:
    rig = Parameters()
    corner = rigid_body.pose_of(np.array([[-0.1, 0.1], [0.2, 0.2]]), rig).end_effector
    highest, lowest = np.arctan2(corner[1], corner[0])
    assert f"{lowest:.4g} to {highest:.4g} rad above x" in geometry.workspace(rig)
    np.testing.assert_allclose(geometry.inverse_geometry(corner, rig), [[-0.1, 0.1], [0.2, 0.2]], atol=1e-12)
    for past in ([-0.1001, 0.0], [0.1001, 0.0], [0.0, -0.2001], [0.0, 0.2001]):
        (_, x), (_, y) = places = rigid_body.pose_of(np.array([[0.0, 0.0], past]).T, rig).end_effector
        with pytest.raises(ValueError, match=re.escape(f"position = ({x:.6g}, {y:.6g}) m is unreachable")):
            geometry.inverse_geometry(places, rig)


@each_rig
def test_motion_kernel_is_the_direct_model_and_its_rate(rig: Parameters) -> None:
    rng = np.random.default_rng(4)
    plant = Plant(rig, 100)
    piston = rng.uniform(-1, 1, (2, 100)) * [[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]]
    speed = rng.uniform(-1, 1, (2, 100))
    plant.state[[Y1, Y2]], plant.state[[V1, V2]] = piston, speed
    p = rigid_body.pose_of(piston, rig)
    velocity, _ = by_points.cartesian_velocity(p, piston[1] + rig.geometry.k2, *speed)
    np.testing.assert_allclose(plant.end_effector(), np.concatenate([p.end_effector, velocity]), rtol=0, atol=1e-11)


def test_pistons_at_which_the_triangle_does_not_close_are_refused():
    """Sides d3, d6 and y1 + k1: the position named is the one furthest beyond, the bounds are those of a flat triangle."""
    size = Parameters().geometry
    low, high = abs(size.d3 - size.d6) - size.k1, size.d3 + size.d6 - size.k1
    for beyond in (high + 0.1, low - 0.01):
        with pytest.raises(ValueError, match=f"y1 = {beyond:g} m is outside the linkage; allowed: {low:g} < y1 < {high:g} m"):
            geometry.theta1([0.0, beyond, 0.05], Parameters())
