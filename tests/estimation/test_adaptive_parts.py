"""What ``admittance-adaptive`` and ``admittance-sensorless`` learn, against signals whose truth is known."""

import numpy as np
import pytest

from baselines.estimation import friction_level, inertia, observers, tracker_noise
from baselines.estimation.friction_level import Friction
from baselines.estimation.hand import force_bias, force_observer
from baselines.estimation.hand.force_observer import Hand
from baselines.estimation.inertia import Inertia
from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from baselines.estimation.tracker_noise import Tracker
from birthsim_env.loop.rows import Signals
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.derived_law import coulomb_levels

PERIOD = 1e-3
AIR = np.full((4, 1), 4e5)
"""Pa: of the chambers."""


def rubbing(coulomb):
    """What is believed of a rig whose pistons have this Coulomb friction, N."""
    rig = Parameters().replace({f"cylinder{k}.coulomb_friction": coulomb for k in (1, 2)})
    return AssumedParameters(observers.assumed_parameters(rig))


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
    friction, fresh, assumed = Friction(np.zeros((Friction.size, 1))), np.ones(1), rubbing(coulomb)
    for k in range(12000):
        speed = 0.05 if (k // 500) % 2 == 0 else -0.05
        drag = np.full((2, 1), coulomb * np.sign(speed))
        left = -(level * drag + offset)
        joints = np.array([[0.0], [0.0], [speed], [speed]])
        friction_level.learn(friction, drag, Joints(joints), AIR, left, 4.0, assumed, fresh)
        fresh[:] = 0.0
    # While u is between +-SLIDING and +-1 it is not yet what the force is: the level ends within the mean of 1/u.
    np.testing.assert_allclose(friction.level, level, rtol=0.02)
    np.testing.assert_allclose(friction.offset, offset, rtol=0.02)


def test_nothing_is_learned_of_a_piston_that_is_stuck():
    friction, fresh, drag = Friction(np.zeros((Friction.size, 1))), np.ones(1), np.full((2, 1), 12.0)
    assumed, still = rubbing(12.0), Joints(np.zeros((Joints.size, 1)))
    for _ in range(1000):
        friction_level.learn(friction, drag, still, AIR, np.zeros((2, 1)), 4.0, assumed, fresh)
        fresh[:] = 0.0
    np.testing.assert_array_equal(friction.level, 1.0)


TARED = {
    "up to what its bias can be": (0.0, lambda time: (0.0, -50.0), (0.0, -47.5)),
    "but for a hand that comes meanwhile": (0.0, lambda time: (20.0 * (time > 0.1), -8.0 * (time > 0.2)), (20.0, -8.0)),
    "not at all where a law starts later": (3.0, lambda time: (1.0, 1.0), (1.5, 1.5)),
}
"""When it begins, s; the hand, N, beside a bias of 0.5 N; and what is taken for the hand."""


@pytest.mark.parametrize(("begin", "hand", "found"), TARED.values(), ids=TARED)
def test_a_force_sensor_is_tared(begin, hand, found):
    memory, force = np.zeros((2, 1)), np.empty((2, 1))
    for time in begin + PERIOD * np.arange(1000):
        force_bias.tare(memory, np.array([time]), np.transpose([hand(time)]) + 0.5, 2.0, 0.5, PERIOD, force)
    np.testing.assert_allclose(force[:, 0], found, atol=1e-12)


SWING, PUSH, SECONDS = 2.0 * np.pi * 7.0, np.array([9.0, 14.0]), 3.0
"""1/s, N and s: a hand that swings the head of ``swung``."""


def swung(mass, held=0.0):
    """The mass that is found of a head of ``mass`` on empty chambers that a hand swings. Friction holds a part of the push.

    A constant force, like a weight or a bias, is unknown as well. The observer's d is Newton's law, low-passed three times.
    """
    assumed, p = AssumedParameters(observers.assumed_parameters(Parameters(), 110.0)), Rig(parameter_column(Parameters()))
    kappa, sine, cosine = geometry.pose(0.02, -0.01, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3)[5:]
    found, fresh = Inertia(Inertia.lane(mass=p.mass)[:, None]), np.ones(1)
    pistons, inputs = Pistons(np.zeros((Pistons.size, 1))), Inputs(np.zeros((Inputs.size, 1)))
    lag, kept, pressures = np.zeros((3, 2)), np.exp(-110.0 * PERIOD), np.full((4, 1), p.atmosphere)
    for k in range(int(SECONDS / PERIOD)):
        push = PUSH * np.sin(SWING * k * PERIOD)
        inputs.force[:, 0] = cosine * push[0] + sine * push[1], sine * push[0] - cosine * push[1]
        truth = ((1.0 - held) * push + 20.0) / mass
        pistons.disturbance[:, 0] = lag[2] / [-kappa, 1.0]
        inertia.learn(found, 0, (kappa, sine, cosine), pistons, pressures, inputs, assumed, fresh)
        fresh[:], into = 0.0, truth - push / found.mass[0]
        for stage in lag:
            stage += (1.0 - kept) * (into - stage)
            into = stage
    return found.mass[0]


@pytest.mark.parametrize(("mass", "held"), [(1.0, 0.0), (1.0, 0.3), (1.8, 0.0)])
def test_the_mass_is_that_of_newtons_law_as_far_as_the_swing_outweighs_the_belief(mass, held):
    believed = Parameters().mechanics.mass
    passed = (1.0 + (SWING / 110.0) ** 2) ** -3 / (1.0 + (inertia.CHANGE / SWING) ** 2)
    squares = SECONDS * passed * np.sum(PUSH**2) / 2.0
    expected = (inertia.PRIOR + squares) / (inertia.PRIOR / believed + squares * (1.0 - held) / mass)
    # The constant force begins as a step in d alone, which ends after 0.1 s; a period is 0.04 of a swing's radian.
    assert swung(mass, held) == pytest.approx(expected, rel=0.03)


def test_what_is_stuck_or_heavier_than_believed_changes_nothing():
    assert swung(1.0, held=1.0) == swung(6.0) == Parameters().mechanics.mass


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
        coulomb = np.array(coulomb_levels(AIR[:, 0], (moved, moved), Parameters()))
        left -= force_observer.FRICTION_FRACTION * coulomb * np.sign(moved)
        joints = np.array([*y, moved, moved])[:, None]
        force_observer.observe(found, np.array([k * PERIOD]), Joints(joints), AIR, left[:, None], p, PERIOD, fresh)
        fresh[:] = 0.0
    # The low-pass has had 40 time constants; J changes by 1 % of itself in one of them while the pistons slide.
    np.testing.assert_allclose(found.force[:, 0], hand, rtol=0.01)
