"""The hand's force from an acceleration, against Newton's law with the Jacobian of the geometry; and how it is held at rest."""

import numpy as np
import pytest

from baselines.estimation import observers
from baselines.estimation.hand import friction_candidates, held_force, inertial_force
from baselines.estimation.hand.force_observer import MOST_BIAS, Hand
from baselines.estimation.hand.friction_candidates import Bank
from baselines.estimation.hand.held_force import RestDetector
from baselines.estimation.inertial import Moving
from baselines.estimation.rows import AssumedParameters
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.linkage.geometry import end_effector, joint_force
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.derived_law import coulomb_levels

PERIOD, RIG = 1e-3, Parameters()
P = Rig(parameter_column(RIG))


def pressures_for(force):
    """Of the chambers (4,), Pa, where the pistons push with ``force`` (2,), N, beyond the atmosphere."""
    found = []
    for one, (area_p, area_n) in zip(force, ((P.area_p1, P.area_n1), (P.area_p2, P.area_n2)), strict=True):
        low = 3e5
        found += [(one + low * area_n + P.atmosphere * (area_p - area_n)) / area_p, low]
    return np.array(found)


class Observed:
    """A lane under the observer, which believes ``rig``, at pistons (2,), m, m/s, and under pressures (4,), Pa; no samples of
    positions arrive. Its clock begins at ``time``, s."""

    def __init__(self, rig, time=0.0):
        self.hand, self.hold = (kind(np.zeros((kind.size, 1))) for kind in (Hand, RestDetector))
        self.bank = Bank(friction_candidates.fresh_bank(1)[:, None])
        self.seen, self.moving, self.joints = (kind(np.zeros((kind.size, 1))) for kind in (Seen, Moving, Joints))
        self.assumed, self.fresh, self.seen.time[:] = AssumedParameters(observers.assumed_parameters(rig)), np.ones(1), time

    def see(self, y, speed, acceleration, pressures):
        self.joints.position[:, 0], self.joints.speed[:, 0], self.moving.acceleration[:, 0] = y, speed, acceleration
        inertial_force.observe(
            self.hand,
            self.hold,
            self.bank,
            self.seen,
            self.moving,
            self.joints,
            pressures[:, None],
            np.full(1, 1e-4),
            self.assumed,
            self.fresh,
        )
        self.fresh[:] = 0.0
        self.seen.time[:] += PERIOD


@pytest.mark.parametrize(("v1", "v2"), [(0.08, -0.05), (-0.03, 0.12), (0.2, 0.2)])
def test_while_pistons_slide_it_is_what_newtons_law_asks_for(v1, v2):
    # The instant is late, so that nothing is tared.
    hand, lane = np.array([23.0, -17.0]), Observed(RIG, 3.0)
    start, speed = np.array([0.01, -0.02]), np.array([v1, v2])
    viscous = np.array([P.fv1, P.fv2])

    def place(time):
        return end_effector(start + speed * time, RIG)

    for k in range(200):
        time, step = k * PERIOD, 1e-4
        acceleration = (place(time + step) - 2 * place(time) + place(time - step)) / step**2
        y = start + speed * time
        load = joint_force(P.mass * (acceleration + np.array([0.0, P.gravity])) - hand, y, RIG)
        # Friction grows with the pressures, which grow with it: each round leaves a four-hundredth of the rest.
        pressures = pressures_for(load)
        for _ in range(6):
            coulomb = np.array(coulomb_levels(pressures, speed, RIG))
            drag = coulomb * (1 + (P.static_ratio - 1) / (1 + (speed / P.stribeck) ** 2))
            pressures = pressures_for(load + np.sign(speed) * drag + viscous * speed)
        lane.see(y, speed, acceleration, pressures)
    # The bristles have gone 20 times their deflection; the speed believed is off by the noise of the one that it is told.
    np.testing.assert_allclose(lane.hand.force[:, 0], hand, atol=2 * inertial_force.SPEED_SLIDING * viscous.max())


def held(course, ticks):
    """The force held (ticks, 2) of a lane where ``course(k)`` (2,), N, is found."""
    memory, force, fresh, found = RestDetector(np.zeros((RestDetector.size, 1))), np.zeros((2, 1)), np.ones(1), []
    for k in range(ticks):
        held_force.hold(memory, np.array(course(k))[:, None], PERIOD, fresh, force)
        fresh[:] = 0.0
        found.append(force[:, 0].copy())
    return np.array(found)


def test_noise_at_rest_moves_it_no_more_than_its_slow_mean():
    """A sine of 1.5 N and 2 Hz: while it may move, the force has all of it, at rest 1/63 of it (2 pi 2 Hz/DRIFT)."""
    found = held(lambda k: (5.0 + 1.5 * np.sin(4 * np.pi * k * PERIOD), -2.0), 6000)
    assert np.ptp(found[: round(1e3 * held_force.SETTLES), 0]) == pytest.approx(3.0, rel=1e-3)
    assert np.ptp(found[3000:, 0]) < 3.0 * 2 * held_force.DRIFT / (4 * np.pi)
    np.testing.assert_allclose(found[-1], (5.0, -2.0), atol=0.5)


@pytest.mark.parametrize("step", [held_force.SLOW_LIMIT * 1.5, held_force.QUICK_LIMIT * 1.5])
def test_a_hand_ends_the_rest_and_is_followed_at_once(step):
    found = held(lambda k: (step if k >= 3000 else 0.0, 0.0), 5000)[:, 0]
    began = int(np.argmax(np.isclose(found, step))) - 3000
    # When a low-pass at w of one at w' reaches the limit; the larger step is found by the quick one alone.
    quick = -np.log(1 - held_force.QUICK_LIMIT / step) / held_force.QUICK if step > held_force.QUICK_LIMIT else 2.0
    assert 0 < began * PERIOD < min(quick + 0.01, 2.0)
    assert found[2999] == 0.0
    np.testing.assert_allclose(found[3000 + began : 3000 + began + 500], step)


def test_a_push_below_the_limits_is_taken_slowly():
    step = 0.6 * held_force.SLOW_LIMIT
    found = held(lambda k: (step if k >= 3000 else 0.0, 0.0), 8000)[:, 0]
    expected = step * (1 - np.exp(-held_force.DRIFT * 5.0))
    assert found[-1] == pytest.approx(expected, rel=1e-3)


def test_what_is_there_at_the_start_is_taken_off():
    """A head of 3 kg that is believed to weigh 3.4 kg hangs still."""
    lane, rest = Observed(RIG.replace({"mechanics.mass": 3.4})), np.zeros(2)
    load = joint_force(np.array([0.0, 3.0 * P.gravity]), rest, RIG)
    for _ in range(400):
        lane.see(rest, rest, rest, pressures_for(load))
    error = 0.4 * P.gravity
    assert error < MOST_BIAS
    # The low-pass starts at zero: over the 250 samples of the mean it misses some two.
    np.testing.assert_allclose(lane.hand.force[:, 0], (0.0, 0.0), atol=0.02 * error)
    np.testing.assert_allclose(lane.hand.bias[:, 0], (0.0, error), atol=0.02 * error)
