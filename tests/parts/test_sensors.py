"""Sensor models: when the laboratory's samples are taken and arrive, how noisy they are, and that ideal ones are exact."""

import gymnasium
import numpy as np
import pytest

from birthsim_env.parts.sensors.ideal import IdealSensors
from birthsim_env.parts.sensors.lab import LabSensors
from tests.parts.test_honest_sensors import board, still, swing, watch

CIRCLE = "BirthSIM/Circle-v2"


def lab(electronics, motion, ticks):
    """What the laboratory's sensors show of one rig, by name: (ticks, ..., 1)."""
    return watch(electronics, ticks, 1, motion, model=LabSensors)


def test_ideal_sensors_are_exact_at_every_instant():
    env = gymnasium.make(CIRCLE, randomize="plant").unwrapped
    env.reset(seed=1)
    for _ in range(50):
        info = env.step((0.1, -0.1, 0.05, 0.0))[4]
        seen = env.measurement
        for name, truth in (("position", "position"), ("velocity", "velocity"), ("pressures", "pressure"), ("user_force",) * 2):
            np.testing.assert_array_equal(getattr(seen, name), info[truth])
        assert seen.time == seen.position_time == info["time"]
        assert not seen.sampled
    assert not IdealSensors.sampled


CLOCKS = [
    # control period, s, rate of the tracker, Hz, and its latency, s; one faster than the control clock is read once a period
    *[(0.001, 240.0, 0.004), (0.001, 240.0, 0.0), (0.001, 240.0, 0.0137), (0.001, 1000.0, 0.004), (0.001, 90.0, 0.05)],
    *[(0.00025, 1500.0, 0.004), (0.01, 240.0, 0.004), (0.01, 240.0, 0.0), (0.001, 4000.0, 0.0003), (0.005, 4000.0, 0.012)],
]


@pytest.mark.parametrize(("period", "rate", "latency"), CLOCKS)
def test_what_is_seen_is_late_by_the_latency_and_never_older_than_the_next_sample_allows(period, rate, latency):
    electronics = board(position_noise=0.0, control_period=period, position_rate=rate, position_latency=latency)
    seen = lab(electronics, swing, round(0.6 / period))
    time = period * np.arange(len(seen["position"]))
    taken = seen["position_time"][:, 0]
    assert taken[0] == 0.0, "the first sample is there from the start"
    assert np.all(np.diff(taken) >= 0)
    settled = time >= latency + 1 / rate + period
    assert np.all(taken[time >= latency] <= time[time >= latency] - latency + 1e-9)
    assert np.all((time - taken)[settled] <= latency + 1 / rate + period + 1e-9)
    # Without noise a sample is where the end effector was when it was taken.
    np.testing.assert_allclose(seen["position"][:, :, 0], [swing(t)[:2] for t in taken], atol=1e-12)
    # Each at the first control instant at which it is due.
    ticks, due = np.unique(taken) / period, np.ceil(np.arange(0.6 * rate) / (rate * period) - 1e-9)
    np.testing.assert_allclose(ticks, np.unique(due)[: len(ticks)], atol=1e-6)
    assert ticks[-1] * period > 0.6 - latency - 1 / rate - 2 * period


def test_the_shown_velocity_is_a_slow_difference_that_finds_a_constant_speed():
    def jump(time):
        return 0.5 + 0.1 * max(time - 0.1, 0.0), 0.0, 0.1 * (time > 0.1), 0.0

    seen = lab(board(position_noise=0.0), jump, 500)["velocity"][:, 0, 0]
    np.testing.assert_allclose(seen[:104], 0.0, atol=1e-12)
    assert 0.05 < seen[100 + 4 + 25] < 0.08  # a time constant of 20 ms behind the latency
    assert seen[-1] == pytest.approx(0.1, rel=1e-6)
    noisy = lab(board(), still, 4000)["velocity"][200:]
    assert 1e-3 < noisy.std() < 1e-2


def test_positions_keep_one_noise_between_samples_and_pressures_change_every_period():
    seen = lab(board(), still, 400)
    same = np.diff(seen["position_time"][:, 0]) == 0
    np.testing.assert_array_equal((np.diff(seen["position"][:, :, 0], axis=0) == 0).all(axis=1), same)
    assert np.abs(np.diff(seen["pressures"][:, :, 0], axis=0)).min() > 0


def test_the_laboratory_hides_the_truth_from_policy_and_controller_but_not_from_info():
    env = gymnasium.make(CIRCLE, sensors="lab").unwrapped
    exact = gymnasium.make(CIRCLE).unwrapped
    (observation, info), (_, truth) = env.reset(seed=0), exact.reset(seed=0)
    errors = []
    for _ in range(200):
        observation, reward, _, _, info = env.step((0.0, 0.1, 0.05, 0.0))
        _, paid, _, _, truth = exact.step((0.0, 0.1, 0.05, 0.0))
        # The plant does not care who looks at it.
        for name, value in truth.items():
            np.testing.assert_allclose(info[name], value, rtol=1e-9, atol=1e-12, err_msg=name)
        assert reward == pytest.approx(paid)
        seen = env.measurement
        assert seen.sampled
        assert seen.time == info["time"]
        np.testing.assert_array_equal(seen.user_force, info["user_force"])
        assert info["time"] - 0.0093 <= seen.position_time <= info["time"] - 0.004 + 1e-9
        off = seen.position - info["compliant_target"]
        np.testing.assert_allclose(observation[:2], np.clip(off / 0.01, -10, 10), atol=1e-5)
        np.testing.assert_allclose(observation[2:4], seen.velocity / 0.2, atol=1e-5)
        errors.append(np.abs(seen.velocity - info["velocity"]).max())
        assert np.abs(seen.pressures - info["pressure"]).max() < 5 * 500
    assert np.median(errors) > 1e-3
