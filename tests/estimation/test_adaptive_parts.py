"""What ``admittance-adaptive`` and ``admittance-sensorless`` learn, against signals whose truth is known."""

import numpy as np
import pytest

from baselines.estimation import force_bias, force_observer, friction_level, observers, tracker_noise
from baselines.estimation.force_observer import Hand
from baselines.estimation.friction_level import Friction
from baselines.estimation.rows import Belief
from baselines.estimation.tracker_noise import Tracker
from birthsim_env.loop.rows import Signals
from birthsim_env.loop.signals import Joints
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters

PERIOD = 1e-3


def rubbing(coulomb):
    """What is believed of a rig whose pistons have this Coulomb friction, N."""
    rig = Parameters().replace({f"cylinder{k}.coulomb_friction": coulomb for k in (1, 2)})
    return Belief(observers.belief(rig))


@pytest.mark.parametrize("spread", [2e-5, 1e-4, 5e-4])
def test_tracker_noise_is_found_at_irregular_times_and_any_speed(spread):
    lanes, rng = 64, np.random.default_rng(5)
    tracker, fresh, time = Tracker(np.zeros((Tracker.size, lanes))), np.ones(lanes), np.zeros(lanes)
    signals = Signals(np.zeros((Signals.size, lanes)))
    for _ in range(900):
        time = time + rng.choice([0.004, 0.005, 0.009], lanes)
        signals.position[:] = np.stack([0.1 * time, -0.2 * time]) + spread * rng.standard_normal((2, lanes))
        signals.position_time[:] = time
        for _ in range(2):  # the second time nothing new has arrived
            tracker_noise.observe(tracker, signals, 1e-4, fresh)
            fresh[:] = 0.0
    found = np.sqrt(tracker.variance)
    # Each variance averages some 100 samples of two axes, of which neighbours are correlated; the clip takes 1 %.
    assert np.median(found) == pytest.approx(spread, rel=0.03)
    np.testing.assert_allclose(found, spread, rtol=0.4)


def test_level_and_offset_of_friction_are_told_apart_by_sliding_both_ways():
    coulomb, level, offset = 12.0, 1.6, 4.0
    friction, fresh, belief = Friction(np.zeros((Friction.size, 1))), np.ones(1), rubbing(coulomb)
    for k in range(12000):
        speed = 0.05 if (k // 500) % 2 == 0 else -0.05
        drag = np.full((2, 1), coulomb * np.sign(speed))
        left = -(level * drag + offset)
        joints = np.array([[0.0], [0.0], [speed], [speed]])
        friction_level.learn(friction, drag, Joints(joints), left, 4.0, belief, fresh)
        fresh[:] = 0.0
    # While u is between +-SLIDING and +-1 it is not yet what the force is: the level ends within the mean of 1/u.
    np.testing.assert_allclose(friction.level, level, rtol=0.02)
    np.testing.assert_allclose(friction.offset, offset, rtol=0.02)


def test_nothing_is_learned_of_a_piston_that_is_stuck():
    friction, fresh, drag = Friction(np.zeros((Friction.size, 1))), np.ones(1), np.full((2, 1), 12.0)
    belief, still = rubbing(12.0), Joints(np.zeros((Joints.size, 1)))
    for _ in range(1000):
        friction_level.learn(friction, drag, still, np.zeros((2, 1)), 4.0, belief, fresh)
        fresh[:] = 0.0
    np.testing.assert_array_equal(friction.level, 1.0)


def test_a_force_sensor_is_tared_at_the_start_up_to_what_its_bias_can_be():
    memory, force = np.zeros((2, 1)), np.empty((2, 1))
    measured = np.array([[0.5], [-50.0]])
    for k in range(1000):
        force_bias.tare(memory, np.array([k * PERIOD]), measured, 2.0, PERIOD, force)
    np.testing.assert_allclose(force[:, 0], [0.0, -48.0], atol=1e-12)


def test_a_law_that_starts_later_tares_nothing():
    memory, force = np.zeros((2, 1)), np.empty((2, 1))
    force_bias.tare(memory, np.array([3.0]), np.ones((2, 1)), 2.0, PERIOD, force)
    np.testing.assert_array_equal(force, 1.0)


@pytest.mark.parametrize("slides", [0.0, 0.02])
def test_the_hand_is_found_from_what_the_force_balance_leaves(slides):
    """Both pistons rest, or slide against friction of which the observer takes off its fraction."""
    p, hand = Rig(parameter_column(Parameters())), np.array([7.0, -4.0])
    found, fresh, y = Hand(np.zeros((Hand.size, 1))), np.ones(1), np.array([0.02, -0.01])
    for k in range(1500):
        moved = slides if k >= 500 else 0.0
        y = y + moved * PERIOD
        pose = geometry.pose(y[0], y[1], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3)
        kappa, sine, cosine = pose[5:]
        push = hand if k >= 500 else np.zeros(2)
        left = np.array([mechanics.user_force1(*push, kappa, sine, cosine), mechanics.user_force2(*push, sine, cosine)])
        # Unknown friction is what the fraction leaves out of the believed one.
        left -= force_observer.FRICTION_FRACTION * np.array([p.fc1, p.fc2]) * np.sign(moved)
        joints = np.array([*y, moved, moved])[:, None]
        force_observer.observe(found, np.array([k * PERIOD]), Joints(joints), left[:, None], p, PERIOD, fresh)
        fresh[:] = 0.0
    # The low-pass has had 40 time constants; J changes by 1 % of itself in one of them while the pistons slide.
    np.testing.assert_allclose(found.force[:, 0], hand, rtol=0.01)
