"""What a picture of the rig shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.values import shown, whole_of

LEAST, LARGEST = (320, 240), (7680, 4320)
"""px: sizes of a picture."""


def checked_size(name: str, size: Sequence[int]) -> tuple[int, int]:
    """``size`` (width, height) in px, or a ``ValueError`` that names it, its value and what is allowed."""
    (w, h), (wide, high) = LEAST, LARGEST
    pair = [whole_of(one) for one in size] if isinstance(size, (tuple, list, np.ndarray)) and shape_of(size) == (2,) else []
    width, height = pair if len(pair) == 2 else (None, None)
    if width is None or height is None or not (w <= width <= wide and h <= height <= high):
        raise ValueError(f"{name} = {shown(size)}; allowed: two whole numbers from {w} x {h} to {wide} x {high} px")
    return width, height


@dataclass(frozen=True)
class Scene:
    """What one frame shows; one lane, SI units, pressures absolute. What is not finite is left out of the picture."""

    time: float
    """s"""
    piston: tuple[float, float]
    """Piston positions y1, y2, m from mid stroke."""
    target: tuple[float, float]
    """Target of the end effector (x, y), m."""
    compliant_target: tuple[float, float]
    """Target moved by the user's force (19), (xk, yk), m."""
    user_force: tuple[float, float]
    """(Fx, Fy), N."""
    pressures: tuple[float, float, float, float]
    """Pp1, Pn1, Pp2, Pn2, Pa."""
    stiffness: tuple[float, float]
    """Closed-loop stiffness setpoints Kclx, Kcly, N/m."""
    path: NDArray[np.float64]
    """Reference path (M, 2), m; M may be 0."""
    title: str = ""
    """First line of the picture."""


def path_of(scene: Scene) -> NDArray[np.float64]:
    """The reference path as (M, 2), m."""
    return np.asarray(scene.path, dtype=np.float64).reshape(-1, 2)
