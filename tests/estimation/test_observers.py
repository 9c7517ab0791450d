"""The observer of piston speeds: poles, bias and delay on made-up samples, errors on a rig that a tracker watches."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from baselines import BacksteppingController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import jacobian
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles import linkage_by_points as by_points
from tests.oracles.observed import Sampled

PERIOD = 1e-3
COASTING = Parameters().replace(
    {"mechanics.gravity": 0.0, "cylinder1.viscous_friction": 0.0, "cylinder2.viscous_friction": 0.0, "geometry.gamma3": 1.4}
)
"""Weightless and without viscous friction: while cylinder 1 rests, the model of cylinder 2 is d2y/dt2 = force / m."""


def samples(piston: Callable[[Array], Array], seconds: float, rig: Parameters, force2: float) -> Iterator[Measurement]:
    """What a noiseless tracker shows of pistons that move by ``piston`` (2, T); pressures that push cylinder 2 by ``force2``.

    Samples are due at multiples of 1/rate, are taken at the next control instant and shown ``latency`` later.
    """
    ticks, rate, latency = round(seconds / PERIOD), rig.electronics.position_rate, rig.electronics.position_latency
    taken = np.unique(np.ceil(np.arange(0, seconds, 1 / rate) / PERIOD - 1e-9).astype(int))
    pressures = np.full((4, 1), rig.air.atmospheric_pressure)
    pressures[2] += force2 / rig.cylinder2.area_p
    for tick in range(ticks):
        shown = taken[max(0, np.searchsorted(taken, tick - latency / PERIOD + 1e-9, side="right") - 1)]
        y1, y2 = piston(np.array([shown * PERIOD]))
        point = by_points.pose_from_lengths(y1 + rig.geometry.k1, y2 + rig.geometry.k2, rig.geometry).end_effector
        when, then = np.array([tick * PERIOD]), np.array([shown * PERIOD])
        yield Measurement(when, point, then, np.zeros((2, 1)), pressures, np.zeros((2, 1)), sampled=True)


def steady(times: Array) -> Array:
    """Cylinder 1 rests, cylinder 2 extends at 50 mm/s."""
    return np.array([np.full(times.shape, 0.02), -0.1 + 0.05 * times])


@pytest.mark.parametrize("latency", [0.0, 0.012])
@pytest.mark.parametrize("rate", [1000.0, 250.0, 62.5])
@pytest.mark.parametrize("bandwidth", [30.0, 70.0])
def test_errors_decay_with_a_triple_pole(rate: float, latency: float, bandwidth: float) -> None:
    """Errors at successive samples obey (q - exp(-w/rate))^3 e = 0, q the step from sample to sample, however late they are."""
    rig = COASTING.replace({"electronics.position_rate": rate, "electronics.position_latency": latency})
    estimator, errors = Sampled(rig, bandwidth), []
    for measured in samples(steady, 0.5, rig, force2=6.0):
        estimate = estimator.update(measured)
        truth = steady(measured.time)
        errors.append([estimate[1, 0] - truth[1, 0], estimate[3, 0] - 0.05])
        assert estimate[0, 0] == pytest.approx(0.02, abs=1e-12)
    step, first = round(1 / rate / PERIOD), round((latency + 2 / rate) / PERIOD)
    e, kept = np.array(errors)[first::step], np.exp(-bandwidth / rate)
    left = e[3:] - 3 * kept * e[2:-1] + 3 * kept**2 * e[1:-2] - kept**3 * e[:-3]
    assert np.abs(e[:3]).max() > 1e-4, "there must be something to decay"
    np.testing.assert_array_less(np.abs(left).max(axis=0), 1e-9 * np.abs(e).max(axis=0) + 1e-13)


def watched(rig: Parameters, lanes: int, seconds: float) -> Iterator[tuple[float, Plant, Measurement]]:
    """Time, a rig that goes 50 mm about in 4 s under exact measurements, and the tracker's view of it."""

    def reference(time: float) -> Reference:
        return closed_loop.circling(time, 0.05, 4.0, 2000.0, lanes)

    plant, sense = closed_loop.resting_at(reference(0.0), rig), closed_loop.tracker(rig, lanes)
    law = BacksteppingController(rig, weight_compensation=True)
    for time, _, push, _ in closed_loop.run(plant, law.command, reference, lambda t: np.zeros((2, lanes)), seconds):
        yield time, plant, sense(plant, time, push)


def rms(values: Array) -> Array:
    """Of both rows, over time and lanes."""
    return np.asarray(np.sqrt((np.asarray(values) ** 2).mean(axis=(0, 2))))


@pytest.mark.parametrize(
    ("rig", "position", "speed"),
    [
        pytest.param(closed_loop.FRICTIONLESS, (5e-5, 1.2e-4), (0.003, 0.007), id="frictionless", marks=pytest.mark.slow),
        pytest.param(Parameters(), (6e-5, 2.1e-4), (0.0045, 0.025), id="LuGre"),
    ],
)
def test_position_and_speed_of_a_moving_rig(rig: Parameters, position: tuple[float, float], speed: tuple[float, float]) -> None:
    """RMS, measured: 0.039, 0.094 mm and 2.2, 5.2 mm/s without friction; 0.043, 0.166 mm and 3.5, 19 mm/s with LuGre."""
    estimator, errors = Sampled(rig), []
    for time, plant, measured in watched(rig, 8, 5.0):
        estimate = estimator.update(measured)
        if time > 1:
            errors.append(estimate - np.concatenate([plant.piston, plant.piston_speed]))
    error = np.array(errors)
    assert np.all(rms(error[:, :2]) < position)
    assert np.all(rms(error[:, 2:]) < speed)
    assert np.abs(error[:, :2].mean(axis=(0, 2))).max() < 1e-5, "no offset"


def test_an_observer_starts_from_what_the_tracker_shows() -> None:
    """Position and speed; 0.6 s later nothing is left of when it began."""
    kept, late = Sampled(closed_loop.FRICTIONLESS), Sampled(closed_loop.FRICTIONLESS)
    for tick, (_, _, measured) in enumerate(watched(closed_loop.FRICTIONLESS, 1, 1.2)):
        expected = kept.update(measured).copy()
        if tick >= 600:
            got = late.update(measured).copy()
        if tick == 600:
            shown = np.linalg.solve(jacobian(got[:2, 0], closed_loop.FRICTIONLESS), measured.velocity[:, 0])
            np.testing.assert_allclose(got[2:, 0], shown, rtol=1e-9)
            assert np.abs(expected[2:]).max() > 0.01
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6)
