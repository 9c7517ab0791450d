"""Friction along the pistons' own motion, against the plant's LuGre law and force balances that are known."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from baselines.estimation import own_friction
from baselines.estimation.observers import ESTIMATE, FRESH, REST
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.physics.rig.parameters import Parameters

PERIOD, RIG = 1e-3, Parameters()
P = parameter_column(RIG)


def parts(lanes=1):
    """Memory, the observer's memory, levels, ``fresh``, ``friction`` and ``before``."""
    return (
        np.zeros((own_friction.ROWS, lanes)), np.zeros((FRESH, lanes)), np.ones((2, lanes)), np.zeros(lanes),
        np.empty((2, lanes)), np.empty((2, lanes)),
    )  # fmt: skip


@pytest.mark.parametrize("level", [0.5, 1.6])
def test_friction_turns_with_the_piston_as_lugre_says(level):
    """Against SciPy on Canudas de Wit's equations, along a sine of 2 Hz and 3 mm."""
    memory, pistons, levels, fresh, friction, before = parts()
    levels[:] = level
    coulomb, static = level * RIG.cylinder2.coulomb_friction, level * P[at.FS2]
    width, s0 = RIG.friction.stribeck_speed, RIG.friction.bristle_stiffness

    def speed(t):
        return 0.003 * 4 * np.pi * np.cos(4 * np.pi * t)

    def rate(t, z):
        v = speed(t)
        return v - s0 * abs(v) * z / (coulomb + (static - coulomb) / (1 + (v / width) ** 2))

    times = PERIOD * np.arange(1000)
    truth = -s0 * solve_ivp(rate, (0.0, 1.0), [0.0], t_eval=times, rtol=1e-9, atol=1e-12, max_step=1e-3).y[0]
    found = []
    for t in times[1:]:
        pistons[ESTIMATE + 3] = speed(t - 0.5 * PERIOD)
        own_friction.rub(memory, pistons, levels, P, PERIOD, fresh, friction, before)
        found.append(friction[1, 0])
    # A step is exact for the speed in its middle; in it the speed changes by up to 0.5 mm/s, and the bristle by 25 mN of that.
    assert np.abs(np.array(found) - truth[1:]).max() < 0.025


def test_what_holds_a_resting_piston_is_friction_up_to_its_static_level():
    memory, pistons, levels, fresh, friction, before = parts(lanes=3)
    pistons[REST : REST + 2] = [[1.0, 1.0, 0.0]] * 2
    kappa = geometry.pose(0.0, 0.0, *(P[k] for k in (at.K1, at.K2, at.D_SQUARES, at.D_PRODUCT, at.SIN_GAMMA3, at.COS_GAMMA3)))[
        5
    ]
    mass = np.array([[RIG.mechanics.mass * kappa**2], [RIG.mechanics.mass]])
    push = np.array([[-5.0, -50.0, -5.0], [4.0, 50.0, 4.0]])
    own_friction.rub(memory, pistons, levels, P, PERIOD, fresh, friction, before)
    pistons[ESTIMATE + 4 : REST] = push / mass
    own_friction.hold(memory, pistons, levels, P, before, friction)
    static = np.array([P[at.FS1], P[at.FS2]])
    np.testing.assert_allclose(friction[:, 0], push[:, 0])
    np.testing.assert_allclose(friction[:, 1], np.sign(push[:, 1]) * static)
    np.testing.assert_array_equal(friction[:, 2], 0.0)  # a piston that moves keeps its disturbance
    # Nothing is lost, and the bristles stand for it.
    np.testing.assert_allclose(friction + mass * pistons[ESTIMATE + 4 : REST], push, atol=1e-12)
    np.testing.assert_allclose(-RIG.friction.bristle_stiffness * memory[own_friction.BRISTLE : own_friction.GAP], friction)


def test_the_law_is_told_the_reference_at_once_and_the_rest_with_a_lag():
    memory, _, _, fresh, _, _ = parts()
    fresh[:], rest = 1.0, np.zeros((2, 1))
    seconds = 0.04
    for k in range(round(seconds / PERIOD)):
        friction, reference = np.full((2, 1), -12.0), np.full((2, 1), 15.0 if k else -12.0)
        own_friction.tell(memory, rest, reference, PERIOD, fresh, friction)
        fresh[:] = 0.0
        if k == 1:  # the reference has turned, the piston not yet
            np.testing.assert_allclose(friction, 15.0 - own_friction.QUICKNESS * PERIOD * 27.0)
    # A first-order lag in steps of 1/20 of its time constant is 2.6 % faster than exp(-q t).
    left = (friction + 12.0) / 27.0
    np.testing.assert_allclose(left, np.exp(-own_friction.QUICKNESS * (seconds - PERIOD)), rtol=0.06)


def test_of_a_resting_piston_the_law_is_told_what_holds_it():
    memory, _, _, fresh, _, _ = parts()
    friction = np.array([[3.0], [-4.0]])
    own_friction.tell(memory, np.ones((2, 1)), np.full((2, 1), 15.0), PERIOD, fresh, friction)
    np.testing.assert_allclose(friction[:, 0], [3.0, -4.0])
