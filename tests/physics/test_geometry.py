"""Geometry (1), (2), (16), (17): closed formulas against points in the plane, SymPy and numerical differences."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env.physics import geometry
from birthsim_env.physics.compiled.lanes import V1, V2, Y1, Y2
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Geometry, Parameters
from tests.oracles import linkage_by_points as by_points

RIGS = {
    "default": Parameters(),
    "tilted pivot": Parameters(geometry=Geometry(d3=0.42, d6=0.21, gamma3=1.2, k1=0.45, k2=0.55)),
    "d6 longer than d3": Parameters(geometry=Geometry(d3=0.25, d6=0.35, gamma3=2.4)),
    "pivot below": Parameters(geometry=Geometry(gamma3=-2.0)),
}
each_rig = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


def grid(rig: Parameters, steps: int = 31) -> np.ndarray:
    """Piston positions over both whole strokes, (2, steps, steps)."""
    half1, half2 = rig.cylinder1.stroke / 2, rig.cylinder2.stroke / 2
    return np.stack(np.meshgrid(np.linspace(-half1, half1, steps), np.linspace(-half2, half2, steps)))


def pose(piston: np.ndarray, rig: Parameters) -> by_points.Pose:
    return by_points.pose_from_lengths(piston[0] + rig.geometry.k1, piston[1] + rig.geometry.k2, rig.geometry)


@st.composite
def rigs(draw: st.DrawFn) -> Parameters:
    """Any linkage that ``Parameters`` accepts, up to the edges of its limits."""
    d3, d6 = draw(st.floats(0.28, 0.5)), draw(st.floats(0.2, 0.3))
    low, high = max(1.05 * abs(d3 - d6) + 0.1, 0.11), 0.98 * (d3 + d6) - 0.1
    k1 = low + (high - low) * draw(st.floats(0.001, 0.999))
    gamma3, k2 = draw(st.floats(-math.pi, math.pi)), draw(st.floats(0.23, 0.8))
    return Parameters(geometry=Geometry(d3=d3, d6=d6, gamma3=gamma3, k1=k1, k2=k2))


@each_rig
def test_direct_model_meets_both_circles(rig: Parameters) -> None:
    piston = grid(rig)
    np.testing.assert_allclose(geometry.end_effector(piston, rig), pose(piston, rig).end_effector, rtol=0, atol=1e-12)


@each_rig
def test_inverse_model_measures_both_distances(rig: Parameters) -> None:
    point = pose(grid(rig), rig).end_effector
    r4, r2 = by_points.lengths(by_points.pose_from_point(point, rig.geometry))
    expected = np.stack([r4 - rig.geometry.k1, r2 - rig.geometry.k2])
    np.testing.assert_allclose(geometry.inverse_geometry(point, rig), expected, rtol=0, atol=1e-12)


@each_rig
def test_models_are_inverse_over_the_workspace(rig: Parameters) -> None:
    piston = grid(rig, 101)
    back = geometry.inverse_geometry(geometry.end_effector(piston, rig), rig)
    np.testing.assert_allclose(back, piston, rtol=0, atol=1e-12)


@given(rig=rigs(), fraction1=st.floats(-1, 1), fraction2=st.floats(-1, 1))
def test_models_are_inverse_for_any_rig(rig: Parameters, fraction1: float, fraction2: float) -> None:
    piston = np.array([fraction1 * rig.cylinder1.stroke / 2, fraction2 * rig.cylinder2.stroke / 2])
    point = geometry.end_effector(piston, rig)
    np.testing.assert_allclose(geometry.inverse_geometry(point, rig), piston, rtol=0, atol=1e-12)
    np.testing.assert_allclose(point, pose(piston, rig).end_effector, rtol=0, atol=1e-12)


@each_rig
def test_theta1_is_the_angle_from_straight_down(rig: Parameters) -> None:
    piston = grid(rig)
    x, y = pose(piston, rig).end_effector
    difference = geometry.theta1(piston[0], rig) - np.arctan2(x, -y)
    np.testing.assert_allclose(np.exp(1j * difference), 1, rtol=0, atol=1e-12)


def angle_at_attachment(rig: Parameters, y1: np.ndarray) -> np.ndarray:
    """Angle O1 A O3 between the cylinders, from the points."""
    p = pose(np.stack([y1, 0 * y1]), rig)
    to_o1, to_o3 = -p.attachment, p.pivot - p.attachment
    return np.arctan2(np.abs(by_points.cross(to_o1, to_o3)), (to_o1 * to_o3).sum(axis=0))


@each_rig
def test_theta5_and_the_slip_of_the_paper(rig: Parameters) -> None:
    y1 = np.linspace(-0.1, 0.1, 41)
    angle = angle_at_attachment(rig, y1)
    np.testing.assert_allclose(geometry.theta5(y1, rig), math.pi / 2 - angle, rtol=0, atol=1e-12)
    g, r4 = rig.geometry, y1 + rig.geometry.k1
    printed = (r4**2 + g.d6**2 - g.d3**2) / (2 * g.d3 * r4)
    assert np.abs(printed - np.cos(angle)).max() > 0.05


def test_equation_1_follows_from_the_triangle() -> None:
    d3, d6, gamma3, theta = sp.symbols("d3 d6 gamma3 theta", positive=True)
    attachment = sp.Matrix([d6 * sp.sin(theta), -d6 * sp.cos(theta)])
    r4_squared = (attachment - d3 * sp.Matrix([sp.cos(gamma3), sp.sin(gamma3)])).dot(
        attachment - d3 * sp.Matrix([sp.cos(gamma3), sp.sin(gamma3)])
    )
    w, root = r4_squared - d3**2 - d6**2, 2 * d3 * d6 * sp.cos(gamma3 - theta)
    assert sp.simplify(w - 2 * d3 * d6 * sp.sin(gamma3 - theta)) == 0
    assert sp.simplify(geometry.s_squared.py_func(w, 2 * d3 * d6) - root**2) == 0
    arguments = (w, root, 1 / (2 * d3 * d6), sp.sin(gamma3), sp.cos(gamma3))
    assert sp.simplify(geometry.sin_theta1.py_func(*arguments) - sp.sin(theta)) == 0
    assert sp.simplify(geometry.cos_theta1.py_func(*arguments) - sp.cos(theta)) == 0
    to_o3 = d3 * sp.Matrix([sp.cos(gamma3), sp.sin(gamma3)]) - attachment
    assert sp.simplify((-attachment).dot(to_o3) - (r4_squared + d6**2 - d3**2) / 2) == 0, "2 d6 r4 cos(O1 A O3)"


@each_rig
def test_theta1_falls_with_r4_at_2_r4_over_s(rig: Parameters) -> None:
    d3, d6, gamma3, r4 = sp.symbols("d3 d6 gamma3 r4", positive=True)
    slope = sp.diff(gamma3 - sp.asin((r4**2 - d3**2 - d6**2) / (2 * d3 * d6)), r4)
    s = sp.sqrt(4 * d3**2 * d6**2 - (r4**2 - d3**2 - d6**2) ** 2)
    assert sp.simplify(slope + 2 * r4 / s) == 0
    y1, h = np.linspace(-0.099, 0.099, 21), 1e-6
    measured = (geometry.theta1(y1 + h, rig) - geometry.theta1(y1 - h, rig)) / (2 * h)
    g = rig.geometry
    expected = sp.lambdify(r4, slope.subs({d3: g.d3, d6: g.d6}))(y1 + g.k1)
    np.testing.assert_allclose(measured, expected, rtol=1e-7)
    assert np.all(measured < 0), "extending cylinder 1 must lower the end effector"


@each_rig
def test_jacobian_is_the_derivative_of_the_direct_model(rig: Parameters) -> None:
    y1, y2 = sp.symbols("y1 y2")
    g = rig.geometry
    theta = g.gamma3 - sp.asin(((y1 + g.k1) ** 2 - g.d3**2 - g.d6**2) / (2 * g.d3 * g.d6))
    symbolic = sp.Matrix([(y2 + g.k2) * sp.sin(theta), -(y2 + g.k2) * sp.cos(theta)]).jacobian([y1, y2])
    piston = grid(rig, 9)
    expected = np.array(
        [[np.broadcast_to(sp.lambdify((y1, y2), symbolic[i, j])(*piston), piston[0].shape) for j in (0, 1)] for i in (0, 1)],
        dtype=float,
    )
    jacobian = geometry.jacobian(piston, rig)
    np.testing.assert_allclose(jacobian, expected, rtol=0, atol=1e-12)
    h = 1e-6
    for j, unit in enumerate(np.eye(2)):
        moved = h * unit.reshape(2, 1, 1)
        difference = geometry.end_effector(piston + moved, rig) - geometry.end_effector(piston - moved, rig)
        np.testing.assert_allclose(jacobian[:, j], difference / (2 * h), rtol=0, atol=1e-8)


@each_rig
def test_columns_are_orthogonal_with_lengths_kappa_and_1(rig: Parameters) -> None:
    piston = grid(rig)
    first, second = geometry.jacobian(piston, rig).swapaxes(0, 1)
    np.testing.assert_allclose((first * second).sum(axis=0), 0, atol=1e-13)
    np.testing.assert_allclose(np.hypot(*second), 1, rtol=1e-14)
    # The beam turns at v1 / lever, so that the end effector moves across it at r2 / lever per unit of v1.
    r2_over_lever = (piston[1] + rig.geometry.k2) / np.abs(pose(piston, rig).lever)
    np.testing.assert_allclose(np.hypot(*first), r2_over_lever, rtol=1e-12)


@pytest.mark.parametrize(
    ("point", "why"),
    [
        ((0.700001, 0.0), "a micrometre beyond the stroke of cylinder 2"),
        ((0.25, 0.0), "nearer than the shortest cylinder 2"),
        ((0.3, 0.4), "above the shortest cylinder 1"),
        ((-0.5, 0.0), "linkage folded over"),
        ((0.0, 0.0), "the pivot"),
        ((math.nan, 0.0), "no number"),
    ],
)
def test_unreachable_point_is_named_with_the_workspace(point: tuple[float, float], why: str) -> None:
    reachable = (0.5, 0.01)
    with pytest.raises(ValueError, match="unreachable") as error:
        geometry.inverse_geometry(np.transpose([reachable, point, reachable]), Parameters())
    assert f"position = ({point[0]:.6g}, {point[1]:.6g}) m" in str(error.value), why
    assert "0.3 to 0.7 m" in str(error.value), why


def test_edges_of_the_workspace_are_named_rightly_and_reached() -> None:
    rig = Parameters()
    corner = pose(np.array([[-0.1, 0.1], [0.2, 0.2]]), rig).end_effector
    highest, lowest = np.arctan2(corner[1], corner[0])
    assert f"{lowest:.4g} to {highest:.4g} rad above x" in geometry.workspace(rig)
    np.testing.assert_allclose(geometry.inverse_geometry(corner, rig), [[-0.1, 0.1], [0.2, 0.2]], atol=1e-12)


@each_rig
def test_joint_force_does_the_same_work(rig: Parameters) -> None:
    rng = np.random.default_rng(3)
    piston = rng.uniform(-0.95, 0.95, (2, 200)) * [[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]]
    force, speed = rng.uniform(-200, 200, (2, 200)), rng.uniform(-1, 1, (2, 200))
    h = 1e-6
    velocity = (pose(piston + h * speed, rig).end_effector - pose(piston - h * speed, rig).end_effector) / (2 * h)
    power = (geometry.joint_force(force, piston, rig) * speed).sum(axis=0)
    np.testing.assert_allclose(power, (force * velocity).sum(axis=0), rtol=0, atol=1e-5)


@each_rig
def test_motion_kernel_is_the_direct_model_and_its_rate(rig: Parameters) -> None:
    rng = np.random.default_rng(4)
    plant = Plant(rig, 100)
    piston = rng.uniform(-1, 1, (2, 100)) * [[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]]
    speed = rng.uniform(-1, 1, (2, 100))
    plant.state[[Y1, Y2]], plant.state[[V1, V2]] = piston, speed
    p = pose(piston, rig)
    velocity, _ = by_points.cartesian_velocity(p, piston[1] + rig.geometry.k2, *speed)
    np.testing.assert_allclose(plant.end_effector(), np.concatenate([p.end_effector, velocity]), rtol=0, atol=1e-11)
