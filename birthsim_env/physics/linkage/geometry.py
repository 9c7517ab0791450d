"""Geometry of the linkage: direct (DGM) and inverse (IGM) models, the Jacobian (16) and derivatives of the IGM.

Scalar helpers serve the kernels (only + - * / sqrt, so sines and cosines come from the triangle itself); the functions at
the end take arrays of any shape. Angles: ``theta1`` is the tilt of cylinder 2 from straight down, pi/2 is horizontal.
With w = r4^2 - d3^2 - d6^2 and S = sqrt(4 d3^2 d6^2 - w^2): sin(gamma3 - theta1) = w / (2 d3 d6), cos = S / (2 d3 d6).
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import COS_GAMMA3, D_PRODUCT, D_SQUARES, K1, K2, SIN_GAMMA3, V1, V2, Y1, Y2, Array
from birthsim_env.physics.rig.parameters import Parameters

OFF_RAIL = 1e-6
"""m that the locked cylinder would have to move for a place that still counts as on the rail: rounding in a user's file."""


@helper
def s_squared(w: float, d_product: float) -> float:
    """S^2 = (2 d3 d6)^2 - w^2, m4."""
    return d_product * d_product - w * w


@helper
def sin_theta1(w: float, root: float, inverse: float, sin_gamma3: float, cos_gamma3: float) -> float:
    """sin(theta1) from (1); ``root`` is S, ``inverse`` 1/(2 d3 d6)."""
    return (sin_gamma3 * root - cos_gamma3 * w) * inverse


@helper
def cos_theta1(w: float, root: float, inverse: float, sin_gamma3: float, cos_gamma3: float) -> float:
    """cos(theta1) from (1); ``root`` is S, ``inverse`` 1/(2 d3 d6)."""
    return (cos_gamma3 * root + sin_gamma3 * w) * inverse


@helper
def amplification(r2: float, r4: float, inverse: float) -> float:
    """kappa = 2 r2 r4 / S: speed of the end effector across cylinder 2 per speed of cylinder 1; ``inverse`` is 1/S."""
    return 2.0 * r2 * r4 * inverse


@helper
def pose(
    y1: float, y2: float, k1: float, k2: float, d_squares: float, d_product: float, sin_gamma3: float, cos_gamma3: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Lengths r4, r2 (m), w (m2), S^2 (m4), S (m2), kappa, sin(theta1) and cos(theta1) for piston positions y1, y2 (m).

    One division serves all.
    """
    r4, r2 = y1 + k1, y2 + k2
    w = r4 * r4 - d_squares
    s2 = s_squared(w, d_product)
    root = math.sqrt(s2)
    inverse = 1.0 / (d_product * root)
    sine = sin_theta1(w, root, root * inverse, sin_gamma3, cos_gamma3)
    cosine = cos_theta1(w, root, root * inverse, sin_gamma3, cos_gamma3)
    return r4, r2, w, s2, root, amplification(r2, r4, d_product * inverse), sine, cosine


@helper
def length_r4(
    sin_theta: float, cos_theta: float, d_squares: float, d_product: float, sin_gamma3: float, cos_gamma3: float
) -> float:
    """Length of cylinder 1 from theta1: law of cosines, the inverse of (1), m."""
    return math.sqrt(d_squares + d_product * (sin_gamma3 * cos_theta - cos_gamma3 * sin_theta))


def _dimensions(parameters: Parameters) -> tuple[float, float, float, float, float]:
    g = parameters.geometry
    return g.d3, g.d6, g.gamma3, g.k1, g.k2


def _triangle(y1: ArrayLike, parameters: Parameters) -> tuple[Array, Array, Array]:
    """Length r4, w and S for piston positions of cylinder 1; refuses positions where the linkage cannot close."""
    d3, d6, _, k1, _ = _dimensions(parameters)
    r4 = np.asarray(y1, dtype=np.float64) + k1
    w = r4**2 - d3**2 - d6**2
    squared = 4 * d3**2 * d6**2 - w**2
    if not np.all(squared > 0):
        worst = np.asarray(r4).flat[int(np.argmin(squared))] - k1
        raise ValueError(f"y1 = {worst:g} m is outside the linkage; allowed: {abs(d3 - d6) - k1:g} < y1 < {d3 + d6 - k1:g} m")
    return r4, w, np.sqrt(squared)


def theta1(y1: ArrayLike, parameters: Parameters) -> Array:
    """Tilt of cylinder 2 (1), rad, for piston positions ``y1`` (m) of any shape."""
    d3, d6, gamma3, _, _ = _dimensions(parameters)
    _, w, _ = _triangle(y1, parameters)
    return np.asarray(gamma3 - np.arcsin(w / (2 * d3 * d6)))


def theta5(y1: ArrayLike, parameters: Parameters) -> Array:
    """Passive joint between the cylinders (1), rad; the paper prints 2 d3 r4 where the law of cosines needs 2 d6 r4."""
    d3, d6, _, _, _ = _dimensions(parameters)
    r4, _, _ = _triangle(y1, parameters)
    return np.asarray(np.arcsin((r4**2 + d6**2 - d3**2) / (2 * d6 * r4)))


def end_effector(piston: ArrayLike, parameters: Parameters) -> Array:
    """Direct geometric model: end effector (x, y), m, for piston positions (y1, y2), m; both (2, ...)."""
    y1, y2 = np.asarray(piston, dtype=np.float64)
    angle = theta1(y1, parameters)
    r2 = y2 + parameters.geometry.k2
    return np.stack([r2 * np.sin(angle), -r2 * np.cos(angle)])


def workspace(parameters: Parameters) -> str:
    """The reachable set in words, for error messages."""
    y1, y2 = parameters.cylinder1.stroke / 2, parameters.cylinder2.stroke / 2
    if parameters.linkage.is_rail:
        k2, angle = parameters.geometry.k2, parameters.linkage.inclination
        return f"distance {k2 - y2:.4g} to {k2 + y2:.4g} m from the pivot, along the rail, {angle:.4g} rad above x"
    low, high = np.sort(theta1(np.array([-y1, y1]), parameters)) - math.pi / 2
    k2 = parameters.geometry.k2
    return f"distance {k2 - y2:.4g} to {k2 + y2:.4g} m from the pivot of cylinder 2, {low:.4g} to {high:.4g} rad above x"


def inverse_geometry(position: ArrayLike, parameters: Parameters) -> Array:
    """Inverse geometric model: piston positions (y1, y2), m, for end effector positions (x, y), m; both (2, ...).

    Raises ``ValueError`` naming the first point outside the workspace (both strokes) and the workspace.
    """
    d3, d6, gamma3, k1, k2 = _dimensions(parameters)
    x, y = np.asarray(position, dtype=np.float64)
    r2 = np.hypot(x, y)
    with np.errstate(invalid="ignore", divide="ignore"):
        r4 = np.sqrt(d3**2 + d6**2 + 2 * d3 * d6 * np.sin(gamma3 - np.arctan2(x, -y)))
    piston = np.stack([r4 - k1, r2 - k2])
    half = np.array([parameters.cylinder1.stroke / 2, parameters.cylinder2.stroke / 2]).reshape(2, *[1] * np.ndim(x))
    # On the other branch of theta1 (linkage folded over) the direct model would not return to the point.
    branch = np.cos(gamma3 - np.arctan2(x, -y)) > 0
    inside = np.all(np.abs(piston) <= half + 1e-12, axis=0) & branch
    if parameters.linkage.is_rail:
        inside &= np.abs(piston[0]) <= OFF_RAIL
    if not np.all(inside):
        first = int(np.argmin(inside))
        point = (float(np.ravel(x)[first]), float(np.ravel(y)[first]))
        raise ValueError(f"position = ({point[0]:.6g}, {point[1]:.6g}) m is unreachable; allowed: {workspace(parameters)}")
    return piston


def jacobian(piston: ArrayLike, parameters: Parameters) -> Array:
    """Jacobian (16), (2, 2, ...): entry [i, j] is d(x, y)[i] / d(y1, y2)[j] at piston positions (2, ...)."""
    y1, y2 = np.asarray(piston, dtype=np.float64)
    r4, _, root = _triangle(y1, parameters)
    angle = theta1(y1, parameters)
    kappa = 2 * (y2 + parameters.geometry.k2) * r4 / root
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.array([[-kappa * cosine, sine], [-kappa * sine, -cosine]])


def joint_force(force: ArrayLike, piston: ArrayLike, parameters: Parameters) -> Array:
    """Forces along the cylinders that equal a Cartesian force (17): J^T F, N; both (2, ...)."""
    return np.asarray(np.einsum("ij...,i...->j...", jacobian(piston, parameters), np.asarray(force, dtype=np.float64)))


@helper
def end_effector_motion(state: Array, p: Array, motion: Array) -> None:
    """Writes x, y, vx, vy of the end effector for states (18, N) into ``motion`` (4, N)."""
    for i in range(state.shape[1]):
        _, r2, _, _, _, kappa, sine, cosine = pose(
            state[Y1, i], state[Y2, i], p[K1, i], p[K2, i], p[D_SQUARES, i], p[D_PRODUCT, i], p[SIN_GAMMA3, i], p[COS_GAMMA3, i]
        )
        motion[0, i] = r2 * sine
        motion[1, i] = -r2 * cosine
        motion[2, i] = -kappa * cosine * state[V1, i] + sine * state[V2, i]
        motion[3, i] = -kappa * sine * state[V1, i] - cosine * state[V2, i]
