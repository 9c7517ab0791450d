"""Motions in which integrators are compared: opening commands and pushes of a hand, each held for 10 ms, 0.5 s in all."""

import math
from collections.abc import Callable

import numpy as np

from birthsim_env.physics.compiled.lanes import Array

PERIOD, PERIODS = 0.01, 50
"""s for which a command and a push are held, and how many of them make a motion."""

Motion = Callable[[int], tuple[Array, Array]]
"""Number of a period -> opening commands (4,) and user force (2,), N."""

_rng = np.random.default_rng(0)
_JERKS = [(_rng.uniform(0.4, 1), _rng.uniform(-80, 80, 2)) for _ in range(PERIODS)]


def stick_slip(k: int) -> tuple[Array, Array]:
    """Short puffs with rests between, and a hand that hardly moves anything: both pistons stick, slip and stick again.

    Valves with the overlap of the default rig open 6 and 10 %.
    """
    puff = (-1) ** (k // 20) * (k % 10 < 5)
    hand = 4 * math.sin(2 * math.pi * 3 * k * PERIOD), 3 * math.sin(2 * math.pi * 2 * k * PERIOD)
    return puff * np.array([0.15, -0.15, 0.17, -0.17]), np.array(hand)


def strong(k: int) -> tuple[Array, Array]:
    """Valves to 0.7 and jerks of 80 N: up to 0.8 m/s and 1.5 m/s, over half the stroke of cylinder 1."""
    swing = 0.7 * np.sin(2 * math.pi * 2.5 * k * PERIOD + np.array([0, math.pi, 1.0, 1.0 + math.pi]))
    size, jerk = _JERKS[k]
    return swing * size, jerk


def smooth(_: int) -> tuple[Array, Array]:
    """Constant openings beyond the overlap and a constant push: started from speed with open valves, nothing reverses and no
    valve shuts for 40 ms."""
    return np.array([0.15, -0.13, -0.18, 0.15]), np.array([-20.0, -30.0])


MOTIONS: dict[str, Motion] = {"stick-slip": stick_slip, "strong": strong}
"""Those of the accuracy tables."""
