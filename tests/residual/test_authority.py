"""What limits the authority: what oscillates loses it in its direction, what swings takes stiffness; what decays does not."""

import numpy as np
import pytest

from agents.residual.authority import (
    LEAST,
    LEVEL,
    MOST_SOFTENING,
    RECOVERY,
    SOFTENING,
    SWING,
    YIELDING,
    Limiter,
    limit_authority,
)
from birthsim_env.loop.signals import REFERENCES, Joints, Reference
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import rigid_body

PERIOD = 1e-3
TIMES = PERIOD * np.arange(1500)
RIG = Parameters()
PISTON = np.array([[0.02], [-0.05]])
JACOBIAN = rigid_body.jacobians(PISTON, RIG)[0]
SIZES = np.hypot(*JACOBIAN)
"""Speed of the end effector per speed of each piston."""


def new(lanes: int) -> Limiter:
    return Limiter(np.repeat(Limiter.lane(left=1.0)[:, None], lanes, axis=1))


def watched(limiter: Limiter, speeds: Array, targets: Array | None = None) -> Array:
    """The fractions (T, 2, N) while the pistons move with ``speeds`` (T, 2, N) at one place, the target with ``targets``."""
    fractions, lanes = [], speeds.shape[2]
    for k, speed in enumerate(speeds):
        rows = np.zeros((REFERENCES, lanes))
        if targets is not None:
            rows[2:4] = JACOBIAN @ targets[k]
        joints = Joints(np.concatenate([np.repeat(PISTON, lanes, axis=1), speed]))
        limit_authority(joints, Reference(rows), Rig(parameter_column(RIG)), PERIOD, LEVEL, limiter, lanes)
        fractions.append(limiter.left.copy())
    return np.array(fractions)


def shaken(waves: list[Array], cylinder: int) -> Array:
    """Speeds (T, 2, N) of the pistons that move the end effector with ``waves`` (T,), m/s, one per lane, along one way."""
    speeds = np.zeros((len(TIMES), 2, len(waves)))
    speeds[:, cylinder] = np.stack(waves, axis=1) / SIZES[cylinder]
    return speeds


def wave(size: float, frequency: float = 10.0, kept: float = 1.0) -> Array:
    """A sine (T,) of which every half wave keeps a fraction of the one before."""
    return size * kept ** (2 * frequency * TIMES) * np.sin(2 * np.pi * frequency * TIMES)


@pytest.mark.parametrize("cylinder", [0, 1])
@pytest.mark.parametrize("size", [1.01, 2.0, 3.5])
def test_a_sustained_oscillation_lowers_the_fraction_of_its_own_cylinder_down_to_the_least(cylinder: int, size: float) -> None:
    fraction = watched(new(1), shaken([wave(size * LEVEL)], cylinder))[:, :, 0]
    np.testing.assert_array_equal(fraction[:, 1 - cylinder], 1.0)
    # Every half wave after the first two costs a tenth, a larger one more: known once the third has begun.
    half_waves = np.floor(20 * TIMES - 1e-9)
    expected = np.maximum(YIELDING ** (size * np.maximum(half_waves - 1, 0)), LEAST)
    assert np.mean(np.abs(fraction[:, cylinder] - expected) < 1e-12) > 0.97, "but for the instants at which the sign changes"
    assert fraction[-1, cylinder] == LEAST
    assert np.all(np.diff(fraction[:, cylinder]) <= 0)


def test_an_oscillation_that_the_target_asks_for_or_below_the_level_costs_nothing() -> None:
    """Nor does a jump of the hand amid ripple; which half waves are sustained: ``controllers/test_admittance_law.py``."""
    jump = np.where(abs(TIMES - 0.725) < 0.025, 20.0, 1.0) * wave(0.95 * LEVEL)
    speeds = shaken([wave(4 * LEVEL)] * 2 + [jump], 0) + shaken([wave(4 * LEVEL, 7.0)] * 2 + [jump], 1)
    targets = speeds.copy()
    targets[:, :, 1:] = 0.0
    fraction = watched(new(3), speeds, targets)
    np.testing.assert_array_equal(fraction[:, :, [0, 2]], 1.0)
    np.testing.assert_array_equal(fraction[-1, :, 1], LEAST)


def softness_of(waves: list[Array], cylinder: int) -> Array:
    """The softness (T, N) while the pistons are shaken so."""
    limiter, softness = new(len(waves)), []
    for speed in shaken(waves, cylinder):
        watched(limiter, speed[None])
        softness.append(limiter.softness.copy())
    return np.array(softness)


@pytest.mark.parametrize("cylinder", [0, 1])
def test_swings_take_stiffness_that_comes_back_in_time(cylinder: int) -> None:
    """Five half waves of 50 ms; the first two are not known to be sustained. Then it decays by its time constant."""
    swing = np.where(TIMES < 0.26, wave(1.5 * SWING), 0.0)
    small = wave(0.95 * SWING)
    softness = softness_of([swing, small], cylinder)
    np.testing.assert_array_equal(softness[:, 1], 0.0)
    ends = np.array([0.1, 0.15, 0.2, 0.25])
    expected = [SOFTENING * np.exp(-(t - ends[ends < t]) / RECOVERY).sum() for t in TIMES[::10]]
    np.testing.assert_allclose(np.minimum(expected, MOST_SOFTENING), softness[::10, 0], atol=0.02)
    assert 1.5 * SOFTENING < softness.max() < MOST_SOFTENING


def test_stiffness_is_taken_up_to_a_bound() -> None:
    limiter = new(2)
    watched(limiter, shaken([wave(3 * SWING), wave(3 * SWING)], 0))
    assert np.all((limiter.softness > 0.9 * MOST_SOFTENING) & (limiter.softness <= MOST_SOFTENING))
