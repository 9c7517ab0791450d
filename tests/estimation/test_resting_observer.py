"""The observer of pistons that friction holds: less noise, slips noticed, loads taken up, lanes apart."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from baselines.estimation.observers import RELUCTANCE, REST_BANDWIDTH, REST_TIME
from birthsim_env.loop.signals import Measurement
from birthsim_env.parts.sensors.lab import LabSensors
from birthsim_env.physics.compiled.lanes import PRESSURES, Array, parameter_array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linkage.geometry import end_effector, jacobian
from birthsim_env.physics.rig.parameters import Parameters
from tests.estimation.test_observers import PERIOD, rms
from tests.oracles.observed import Sampled

STUCK = np.array([[0.02], [-0.05]])
"""m: where friction holds both pistons."""

LOAD = np.array([[25.0], [-12.0]])
"""N along the pistons, beyond the weight: what friction carries."""


def stuck(rig: Parameters, lanes: int, seconds: float, speed: float = 0.0, slip: float = 9.0) -> Iterator[Measurement]:
    """A tracker's view of pistons that friction holds against ``LOAD``; from 1 s on cylinder 2 moves for ``slip`` s."""
    period = rig.electronics.control_period
    sensors, areas = LabSensors(rig.electronics, lanes), np.array([[rig.cylinder1.area_p], [rig.cylinder2.area_p]])
    for lane in range(lanes):
        sensors.begin(lane, np.random.default_rng([7, lane]))
    pressures = balanced_state(parameter_array(rig, lanes), np.repeat(STUCK, lanes, axis=1))[list(PRESSURES)]
    pressures[[0, 2]] += LOAD / areas
    times = period * np.arange(round(seconds / period))
    moved = speed * np.clip(times - 1.0, 0.0, slip)
    places, nothing = end_effector(STUCK + np.array([0 * moved, moved]), rig), np.zeros((2, lanes))
    for tick, (time, place) in enumerate(zip(times, places.T, strict=True)):
        motion = np.concatenate([np.repeat(place[:, None], lanes, axis=1), nothing])
        yield sensors.measure(np.full(lanes, tick), np.full(lanes, time), motion, pressures, nothing)


def apparent(rig: Parameters) -> Array:
    """Masses (2, 1) that the stuck pistons move, kg."""
    return np.asarray(rig.mechanics.mass * (jacobian(STUCK[:, 0], rig) ** 2).sum(axis=0)[:, None])


def spread(moving: float, rig: Parameters = Parameters(), lanes: int = 16) -> dict[str, Array]:  # noqa: B008
    """RMS over lanes and the last second of 2.5 s: errors of position, speed and of the force that friction bears, (2,)."""
    estimator, kept = Sampled(rig), []
    for measured in stuck(rig, lanes, 2.5):
        estimate = estimator.update(measured, moving=np.full(lanes, moving))
        if measured.time[0] >= 1.5:
            force = (estimator.pistons.disturbance * apparent(rig)) + LOAD
            kept.append([estimate[:2] - STUCK, estimate[2:], force])
    position, speed, force = (rms(np.array(kept)[:, k]) for k in range(3))
    return {"position": position, "speed": speed, "force": force, "rest": estimator.pistons.rest.mean(axis=1)}


def test_a_piston_that_may_not_rest_never_does() -> None:
    """``moving`` 1 is the observer without rest, bit by bit; and 1 again in the middle of a rest ends it at once."""
    rig, lanes = Parameters(), 3
    plain, told, sometimes = Sampled(rig), Sampled(rig), Sampled(rig)
    for measured in stuck(rig, lanes, 1.2):
        late = measured.time[0] >= 1.0
        expected = plain.update(measured).copy()
        assert np.array_equal(told.update(measured, moving=np.ones(lanes)), expected)
        assert np.all(told.pistons.rest == 0)
        sometimes.update(measured, moving=np.full(lanes, float(late)))
        if measured.time[0] == 0.999:
            assert np.all(sometimes.pistons.rest > 0.9)
        assert not (late and sometimes.pistons.rest.any())


@pytest.mark.parametrize("speed", [0.01, 0.03, 0.1])
def test_a_piston_that_slips_is_noticed(speed: float) -> None:
    """Mostly before 0.35 mm and 10 ms; slower than the noise of speed it falls back to rest and trails by 0.06 mm."""
    rig, lanes, woken, errors = Parameters(), 16, np.full(16, np.inf), []
    estimator = Sampled(rig)
    for measured in stuck(rig, lanes, 1.5, speed):
        estimate, time = estimator.update(measured, moving=np.zeros(lanes)), measured.time[0]
        woken = np.where((time >= 1.0) & (estimator.pistons.rest[1] < 0.5) & np.isinf(woken), time - 1.0, woken)
        if time > 1.4:
            errors.append([estimate[1] - STUCK[1] - speed * (time - 1.0), estimate[3] - speed])
    assert np.median(woken) < 0.00035 / speed + 0.01
    assert woken.max() < 0.001 / speed + 0.01
    position, rate = np.array(errors).mean(axis=(0, 2))
    assert abs(position) < 1e-3
    assert abs(rate) < (0.05 * speed if speed > 0.02 else speed)


def settling(told: bool) -> float:
    """Time in which cylinder 2 comes to rest by 63 % after a slip of 40 ms, of which the observer is told or not, s."""
    estimator, times, rests = Sampled(Parameters()), [], []
    for measured in stuck(Parameters(), 8, 2.6, 0.05, 0.04):
        time = measured.time[0]
        estimator.update(measured, moving=np.full(8, float(told and 1.0 <= time < 1.08)))
        times.append(time)
        rests.append(np.median(estimator.pistons.rest[1]))
    after, seconds = np.array(rests) > 1 - np.exp(-1), np.array(times)
    awake = seconds[(seconds > 1.0) & ~after].min()
    return float(seconds[(seconds > awake) & after].min() - awake)


def test_a_piston_that_has_slipped_unasked_is_slow_to_rest_again() -> None:
    """Six times as slow; one that was asked to move is as quick as at first."""
    assert settling(told=False) == pytest.approx((1 + RELUCTANCE) * REST_TIME, rel=0.3)
    assert settling(told=True) == pytest.approx(0.08 + REST_TIME, rel=0.5)


@pytest.mark.parametrize("period", [pytest.param(2.5e-4, marks=pytest.mark.slow), 1e-3, 2e-3, 1e-2])
def test_other_control_periods(period: float) -> None:
    """Noise at rest and awake is much the same at all of them, less at rest, and the load that friction bears is found."""
    rig = Parameters().replace({"electronics.control_period": period})
    resting, awake = spread(0.0, rig, 6), spread(1.0, rig, 6)
    assert np.all(awake["rest"] == 0)
    assert np.all(resting["rest"] > 0.95)
    for name, fraction in (("position", 0.3), ("speed", 0.1), ("force", 0.5)):
        assert np.all(resting[name] < fraction * awake[name]), name
    assert np.all(resting["position"] < [1.5e-5, 4e-5])
    assert np.all(resting["speed"] < [1e-4, 5e-4])
    assert np.all(resting["force"] < 0.3)
    assert np.all(awake["position"] < [1e-4, 2.5e-4])
    assert np.all(awake["speed"] < [0.006, 0.016])
    assert np.all(awake["force"] < 1.5)


def test_at_rest_friction_takes_up_the_load_with_a_double_pole() -> None:
    """Without samples: d goes to what friction must bear, in steps with the pole exp(-wr T) twice."""
    rig = Parameters().replace({"electronics.position_noise": 0.0, "electronics.pressure_noise": 0.0})
    estimator, loads = Sampled(rig), []
    for tick, measured in enumerate(stuck(rig, 1, 0.1)):
        frozen = dataclasses.replace(measured, position_time=np.zeros(1))
        if tick == 1:
            estimator.pistons.rest[:] = 1.0
        estimator.update(frozen, moving=np.zeros(1))
        loads.append((estimator.pistons.disturbance * apparent(rig) + LOAD)[:, 0])
    error, kept = np.array(loads)[1:], np.exp(-REST_BANDWIDTH * PERIOD)
    left = error[2:] - 2 * kept * error[1:-1] + kept**2 * error[:-2]
    np.testing.assert_allclose(left[1:], 0, rtol=0, atol=2e-3 * np.abs(LOAD).max())
    assert np.abs(error[-1]).max() < 0.1
