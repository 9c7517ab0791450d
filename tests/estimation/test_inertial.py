"""Motion from acceleration and late positions, against the recurrence of a triple pole and the Kalman filter."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from baselines.estimation import inertial
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.rig.parameters import Parameters

PERIOD, EVERY = 1e-3, 4
LATE_ENOUGH = 20.0
"""s: what makes the observer faster at a start has decayed to e^-130."""


def run(ticks, motion, acceleration, noise=0.0, latency=0.004, lost=0.0, lanes=1, begin=0.0, wrong=(0.0, 0.0, 0.0), old=0.0):
    """Truth and estimate (ticks, 4, lanes), where the observer started ``old`` s before ``begin``, s.

    ``motion(t)`` -> (x, v) on both axes; ``acceleration(t, k)`` -> (2, lanes) is felt; ``wrong``: x, v and bias are put off.
    """
    stage, rng = inertial.controller_stage(Parameters()), np.random.default_rng(7)
    memory, gains = inertial.Memory(np.repeat(stage.fresh[:, None], lanes, axis=1)), inertial.Gains(stage.constants)
    point, signals = inertial.Moving(np.empty((inertial.Moving.size, lanes))), Signals(np.zeros((Signals.size, lanes)))
    taken, truth, found = [(begin, *(np.full((2, lanes), one) for one in motion(begin)))], [], []
    for k in range(ticks):
        time = begin + k * PERIOD
        x, v = motion(time)
        if k % EVERY == 0 and rng.uniform() >= lost:
            taken.append((time, x + noise * rng.standard_normal((2, lanes)), v))
        stamp, shown, _ = next(one for one in reversed(taken) if one[0] <= time - latency + 1e-9 or one is taken[0])
        signals.time[:], signals.position[:], signals.position_time[:] = time, shown, stamp
        signals.velocity[:], signals.acceleration[:] = v, acceleration(time, lanes)
        inertial.observe(memory, signals, gains, point)
        if k == 0:
            memory.began[:] -= old
            for own, off in zip((memory.position, memory.velocity, memory.bias), wrong, strict=True):
                own[:] += off
        truth.append(np.array([[x], [x], [v], [v]]) + np.zeros((4, lanes)))
        found.append(point.rows[:4].copy())
    return np.array(truth), np.array(found)


@pytest.mark.parametrize("wrong", [(1e-3, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.3)])
def test_an_error_dies_away_by_a_triple_pole(wrong):
    _, found = run(600, lambda t: (0.0, 0.0), lambda t, n: np.zeros((2, n)), latency=0.0, old=LATE_ENOUGH, wrong=wrong)
    pole, e = np.exp(-inertial.BANDWIDTH * EVERY * PERIOD), found[2 * EVERY :: EVERY, 0, 0]
    left = e[3:] - 3 * pole * e[2:-1] + 3 * pole**2 * e[1:-2] - pole**3 * e[:-3]
    assert np.abs(e).max() > 1e-5
    assert np.abs(left).max() < 1e-12 * max(1.0, 1 / np.abs(e).max())


@pytest.mark.parametrize("latency", [0.0, 0.004, 0.0073])
def test_late_rare_and_lost_samples_leave_no_error(latency):
    bias, jerk = 0.15, 0.8
    truth, found = run(
        2500,
        lambda t: (0.1 * t + jerk * t**3 / 6, 0.1 + jerk * t**2 / 2),
        lambda t, n: np.full((2, n), jerk * (t - PERIOD / 2) + bias),
        latency=latency,
        lost=0.2,
    )
    # What a third of a period's change of acceleration leaves of a parabola: jerk PERIOD^3/24 a period.
    np.testing.assert_allclose(found[-500:, :2], truth[-500:, :2], atol=2e-6)
    np.testing.assert_allclose(found[-500:, 2:], truth[-500:, 2:], atol=2e-5)


def test_it_starts_as_fast_at_any_time():
    """A law that takes over while a rig moves does not know its speed either."""

    def found(begin):
        course = lambda t: (0.1 * (t - begin), 0.1)  # noqa: E731
        return run(400, course, lambda t, n: np.full((2, n), 0.1), begin=begin, wrong=(0.0, 0.05, 0.0))[1]

    np.testing.assert_allclose(found(32.0), found(0.0), atol=1e-9)


def test_the_speed_is_nearly_as_good_as_a_kalman_filter_of_samples_without_delay():
    spread, noise, lanes = 0.02, 1e-4, 40
    rng = np.random.default_rng(3)
    truth, found = run(
        5000, lambda t: (0.0, 0.0), lambda t, n: spread * rng.standard_normal((2, n)), noise=noise, lanes=lanes, old=LATE_ENOUGH
    )
    q, r = spread**2 * PERIOD, noise**2 * EVERY * PERIOD
    best = solve_continuous_are(
        np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.0], [0.0]]), np.diag([0.0, q]), np.array([[r]])
    )
    speed = found[2000:, 2:] - truth[2000:, 2:]
    # It estimates a bias as well, with more bandwidth, from samples that are 4 ms late.
    assert np.sqrt(best[1, 1]) == pytest.approx(2.4e-4, rel=0.05)
    assert np.sqrt(best[1, 1]) < np.sqrt((speed**2).mean()) < 2.2 * np.sqrt(best[1, 1])
