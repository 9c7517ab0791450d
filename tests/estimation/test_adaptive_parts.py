"""What ``admittance-adaptive`` and ``admittance-sensorless`` learn, against signals whose truth is known."""

import numpy as np
import pytest

from baselines.estimation import force_bias, force_observer, friction_level, tracker_noise
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.physics.rig.parameters import Parameters

PERIOD = 1e-3


@pytest.mark.parametrize("spread", [2e-5, 1e-4, 5e-4])
def test_tracker_noise_is_found_at_irregular_times_and_any_speed(spread):
    lanes, rng = 64, np.random.default_rng(5)
    memory, fresh, time = np.zeros((tracker_noise.ROWS, lanes)), np.ones(lanes), np.zeros(lanes)
    for _ in range(900):
        time = time + rng.choice([0.004, 0.005, 0.009], lanes)
        position = np.stack([0.1 * time, -0.2 * time]) + spread * rng.standard_normal((2, lanes))
        for _ in range(2):  # the second time nothing new has arrived
            tracker_noise.observe(memory, position, time, 1e-4, fresh)
            fresh[:] = 0.0
    found = np.sqrt(memory[tracker_noise.VARIANCE])
    # Each variance averages some 100 samples of two axes, of which neighbours are correlated; the clip takes 1 %.
    assert np.median(found) == pytest.approx(spread, rel=0.03)
    np.testing.assert_allclose(found, spread, rtol=0.4)


def test_level_and_offset_of_friction_are_told_apart_by_sliding_both_ways():
    coulomb, level, offset = 12.0, 1.6, 4.0
    memory, fresh = np.zeros((friction_level.ROWS, 1)), np.ones(1)
    for k in range(12000):
        speed = 0.05 if (k // 500) % 2 == 0 else -0.05
        drag = np.full((2, 1), coulomb * np.sign(speed))
        left = -(level * drag + offset)
        joints = np.array([[0.0], [0.0], [speed], [speed]])
        friction_level.learn(memory, drag, coulomb, coulomb, joints, left, PERIOD, 4.0, fresh)
        fresh[:] = 0.0
    # While u is between +-SLIDING and +-1 it is not yet what the force is: the level ends within the mean of 1/u.
    np.testing.assert_allclose(memory[friction_level.LEVEL : friction_level.OFFSET], level, rtol=0.02)
    np.testing.assert_allclose(memory[friction_level.OFFSET : friction_level.SLIDES], offset, rtol=0.02)


def test_nothing_is_learned_of_a_piston_that_is_stuck():
    memory, fresh, drag = np.zeros((friction_level.ROWS, 1)), np.ones(1), np.full((2, 1), 12.0)
    for _ in range(1000):
        friction_level.learn(memory, drag, 12.0, 12.0, np.zeros((4, 1)), np.zeros((2, 1)), PERIOD, 4.0, fresh)
        fresh[:] = 0.0
    np.testing.assert_array_equal(memory[friction_level.LEVEL : friction_level.OFFSET], 1.0)


def test_a_force_sensor_is_tared_at_the_start_up_to_what_its_bias_can_be():
    memory, force = np.zeros((force_bias.ROWS, 1)), np.empty((2, 1))
    measured = np.array([[0.5], [-50.0]])
    for k in range(1000):
        force_bias.tare(memory, np.array([k * PERIOD]), measured, 2.0, PERIOD, force)
    np.testing.assert_allclose(force[:, 0], [0.0, -48.0], atol=1e-12)


def test_a_law_that_starts_later_tares_nothing():
    memory, force = np.zeros((force_bias.ROWS, 1)), np.empty((2, 1))
    force_bias.tare(memory, np.array([3.0]), np.ones((2, 1)), 2.0, PERIOD, force)
    np.testing.assert_array_equal(force, 1.0)


@pytest.mark.parametrize("slides", [0.0, 0.02])
def test_the_hand_is_found_from_what_the_force_balance_leaves(slides):
    """Both pistons rest, or slide against friction of which the observer takes off its fraction."""
    p, hand = parameter_column(Parameters()), np.array([7.0, -4.0])
    memory, fresh, force, y = np.zeros((force_observer.ROWS, 1)), np.ones(1), np.empty((2, 1)), np.array([0.02, -0.01])
    for k in range(1500):
        moved = slides if k >= 500 else 0.0
        y = y + moved * PERIOD
        pose = geometry.pose(
            y[0], y[1], p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        kappa, sine, cosine = pose[5:]
        push = hand if k >= 500 else np.zeros(2)
        left = np.array([mechanics.user_force1(*push, kappa, sine, cosine), mechanics.user_force2(*push, sine, cosine)])
        # Unknown friction is what the fraction leaves out of the believed one.
        left -= force_observer.FRICTION_FRACTION * np.array([p[at.FC1], p[at.FC2]]) * np.sign(moved)
        joints = np.array([*y, moved, moved])[:, None]
        force_observer.observe(memory, np.array([k * PERIOD]), joints, left[:, None], p, PERIOD, fresh, force)
        fresh[:] = 0.0
    # The low-pass has had 40 time constants; J changes by 1 % of itself in one of them while the pistons slide.
    np.testing.assert_allclose(force[:, 0], hand, rtol=0.01)
