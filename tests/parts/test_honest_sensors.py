"""The sensor model ``honest``: every error against statistics, closed forms or what ``lab`` shows, and all of them off."""

import math

import numpy as np
import pytest
from scipy.special import j0

from birthsim_env import Parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.sensors.honest import HonestSensors
from birthsim_env.parts.sensors.lab import LabSensors
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS

LAB = ("position_noise", "position_latency", "pressure_noise")
OFF = {name: 0.0 for name in SENSOR_PARAMETERS if name not in (*LAB, "distortion_length")}
"""``lab``'s figures, and no other error."""
EXACT = {**OFF, **dict.fromkeys(LAB, 0.0), "position_rate": 1000.0}
"""No error at all, and a sample every period."""
HOME = np.array([0.5, 0.0])


def board(**changes):
    return Parameters().replace({f"electronics.{name}": value for name, value in changes.items()}).electronics


NAMES = ("position", "position_time", "velocity", "pressures", "user_force")


def still(time):
    return *HOME, 0.0, 0.0


def none(time):
    return 0.0, 0.0


def watch(electronics, ticks, lanes=1, motion=still, force=none, pressures=3e5, model=HonestSensors, ranges=None, names=NAMES):
    """What is shown in ``ticks`` control periods, by name: (ticks, ..., lanes), of one motion (4,) and force (2,) at a time."""
    sensors = model(electronics, lanes)
    if ranges:
        sensors.vary(ranges)
    for lane in range(lanes):
        sensors.begin(lane, stream(lane, 0, "sensors"))
    rows = {name: [] for name in names}
    for tick in range(ticks):
        time = np.full(lanes, tick * electronics.control_period)
        moved, pushed = (np.repeat(np.transpose([one(time[0])]), lanes, axis=1) for one in (motion, force))
        seen = sensors.measure(np.full(lanes, tick), time, moved, np.full((4, lanes), pressures), pushed)
        for name in names:
            rows[name].append(getattr(seen, name).copy())
    return {name: np.array(values) for name, values in rows.items()}


def swing(time):
    return 0.5 + 0.05 * math.sin(3 * time), 0.02 * time, 0.15 * math.cos(3 * time), 0.02


def pull(time):
    return 30 * math.sin(40 * time), -20 * math.cos(7 * time)


@pytest.mark.parametrize("changes", [{}, {"position_latency": 0.0137}, {"control_period": 0.004, "position_rate": 1500.0}])
def test_with_every_error_off_it_is_lab_to_the_last_bit(changes):
    electronics = board(**OFF, **changes)
    honest, lab = (watch(electronics, 400, 3, swing, pull, model=model) for model in (HonestSensors, LabSensors))
    for name, values in lab.items():
        np.testing.assert_array_equal(honest[name], values, err_msg=name)


SURE = {"acceleration_bias": 0.0, "acceleration_gain_error": 0.0, "acceleration_bandwidth": 300.0}
NOISES = [
    # model, what is shown, its figure, that figure, other figures, what is shown without it
    (LabSensors, "position", "position_noise", 1e-4, {}, HOME[:, None]),
    (LabSensors, "pressures", "pressure_noise", 500.0, {}, 3e5),
    (HonestSensors, "user_force", "force_noise", 0.3, {}, 0.0),
    *((model, "acceleration", "acceleration_noise", 0.05, SURE, 0.0) for model in (LabSensors, HonestSensors)),
]


@pytest.mark.parametrize(("model", "name", "figure", "deviation", "others", "true"), NOISES)
def test_noise_is_normal_of_its_figure_and_independent_over_time_channels_and_lanes(
    model, name, figure, deviation, others, true
):
    shown = watch(board(**{**EXACT, **others, figure: deviation}), 4000, 10, model=model, names=(name,))[name]
    values = ((shown - true) / deviation).reshape(4000, -1)
    count = values.size
    assert abs(values.mean()) < 4.5 / math.sqrt(count)
    assert abs(values.std() - 1) < 4.5 / math.sqrt(2 * count)
    assert abs((values**3).mean()) < 4.5 * math.sqrt(15 / count)
    assert abs((values**4).mean() - 3) < 4.5 * math.sqrt(96 / count)
    # In every channel of every lane as well.
    assert np.abs(values.std(axis=0) - 1).max() < 5 / math.sqrt(2 * 4000)
    assert (np.abs(values) > 2).mean() == pytest.approx(0.0455, abs=4.5 * math.sqrt(0.0455 * 0.9545 / count))
    for lag in (1, 2, 5):
        assert np.abs((values[lag:] * values[:-lag]).mean(axis=0)).max() < 5 / math.sqrt(4000 - lag)
    assert np.abs(np.corrcoef(values.T) - np.eye(values.shape[1])).max() < 5.2 / math.sqrt(4000)


def assert_uniform(values, most, name=""):
    """Up to ``most`` either way; of a uniform distribution: mean square 1/3, its deviation sqrt(4/45)."""
    scaled = values / most
    assert np.abs(scaled).max() <= 1 + 1e-9, name
    assert abs(scaled.mean()) < 4.5 * math.sqrt(1 / 3 / len(scaled)), name
    assert (scaled**2).mean() == pytest.approx(1 / 3, abs=4.5 * math.sqrt(4 / 45 / len(scaled))), name


def test_gain_crosstalk_and_bias_belong_to_the_episode_and_are_uniform_up_to_their_figures():
    figures = {"force_gain_error": 0.05, "force_crosstalk": 0.03, "force_bias": 2.0}
    lanes = 1500
    seen = watch(board(**{**EXACT, **figures}), 60, lanes, force=pull)["user_force"]
    applied = np.array([(*pull(1e-3 * tick), 1.0) for tick in range(60)])
    found, rest = np.linalg.lstsq(applied, seen.reshape(60, 2 * lanes), rcond=None)[:2]
    assert rest.max() < 1e-20, "one line through all instants"
    # Rows are factors of Fx and Fy and the bias; of y's sensor Fy is its own.
    errors = np.concatenate([found[:, :lanes], found[[1, 0, 2], lanes:]], axis=1) - [[1], [0], [0]]
    for (name, most), values in zip(figures.items(), errors, strict=True):
        assert_uniform(values, most, name)


@pytest.mark.parametrize("bandwidth", [30.0, 200.0])
def test_the_force_passes_a_first_order_low_pass(bandwidth):
    seen = watch(board(**{**EXACT, "force_bandwidth": bandwidth}), 60, force=lambda t: (10.0 * (t > 0.0095), 0.0))["user_force"]
    after = 1e-3 * np.arange(1, 51)
    np.testing.assert_allclose(seen[:10, 0, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(seen[10:, 0, 0], 10 * (1 - np.exp(-2 * math.pi * bandwidth * after)), rtol=1e-9)


@pytest.mark.parametrize("latency", [0.0, 0.001, 0.0025, 0.02])
def test_the_force_is_late_by_the_latency(latency):
    seen = watch(board(**{**EXACT, "force_latency": latency}), 100, force=lambda t: (50 * t + 3, -20 * t))["user_force"]
    time = np.maximum(1e-3 * np.arange(100) - latency, 0)
    np.testing.assert_allclose(seen[:, :, 0], np.stack([50 * time + 3, -20 * time], axis=1), atol=1e-9)


def test_a_converter_rounds_to_its_steps_and_saturates():
    electronics = board(**{**EXACT, "adc_bits": 10.0, "force_range": 100.0, "pressure_range": 8e5})
    seen = watch(electronics, 300, force=lambda t: (1000 * (t - 0.15), 7.1), pressures=123456.0)
    force, step = seen["user_force"][:, 0, 0], 200 / 1024
    true = 1000 * (1e-3 * np.arange(300) - 0.15)
    np.testing.assert_allclose(force / step, np.round(force / step), atol=1e-9)
    assert np.abs(force - np.clip(true, -100, 100)).max() <= step / 2 + 1e-9
    assert (force.min(), force.max()) == (-100, 100)
    assert len(np.unique(force)) == 201  # every newton has a step of its own
    np.testing.assert_allclose(seen["pressures"], round(123456 / 8e5 * 1024) * 8e5 / 1024)
    np.testing.assert_array_equal(watch(electronics, 3, pressures=9e5)["pressures"], 8e5)
    one, other = (watch(board(**{**EXACT, "adc_bits": bits}), 40, force=pull)["user_force"] for bits in (11.6, 12.0))
    np.testing.assert_array_equal(one, other, "bits are whole")


@pytest.mark.parametrize("place", [(0.5, 0.0), (0.5, 0.15), (0.62, -0.1)])
def test_the_trackers_noise_grows_with_the_power_of_the_distance(place):
    electronics = board(**{**EXACT, "position_noise": 1e-4, "position_noise_growth": 4.0})
    seen = watch(electronics, 2000, 5, lambda t: (*place, 0, 0))["position"].reshape(2000, 2, 5) - np.array(place)[:, None]
    expected = 1e-4 * (math.hypot(place[0] - 0.5, place[1] + 0.3) / 0.3) ** 4
    assert seen.std() == pytest.approx(expected, rel=4.5 / math.sqrt(2 * seen.size))


def field(electronics, places, lanes):
    """The tracker's error at ``places`` (P, 2): (P, 2, lanes)."""
    shown = watch(electronics, len(places), lanes, lambda t: (*places[round(t * 1e3)], 0, 0))["position"]
    return shown - np.asarray(places)[:, :, None]


def test_the_distortion_has_the_size_and_the_correlation_of_isotropic_waves():
    lanes, size, length = 4000, 1e-3, 0.6
    distances = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.3])
    waves = board(**{**EXACT, "position_distortion": size, "distortion_length": length})
    errors = field(waves, HOME + np.outer(distances, (0.6, 0.8)), lanes).reshape(len(distances), -1)
    np.testing.assert_allclose(errors[0], 0.0, atol=1e-15)
    # E (F(r) - F(0))^2 = 2 A^2 (1 - J0(k r)) for waves from all directions.
    expected = 2 * size**2 * (1 - j0(2 * math.pi / length * distances))
    squares = errors**2
    deviation = squares.std(axis=1) / math.sqrt(2 * lanes)
    assert np.all(np.abs(squares.mean(axis=1) - expected) <= 4.5 * deviation)
    assert np.all(np.abs(errors.mean(axis=1)) <= 4.5 * errors.std(axis=1) / math.sqrt(2 * lanes))


def test_the_scale_of_the_tracker_is_off_about_its_registration():
    places = HOME + np.array([(0.0, 0.0), (0.1, 0.0), (0.0, -0.05)])
    errors = field(board(**{**EXACT, "position_scale_error": 0.02}), places, 500)
    scales = errors[1, 0] / 0.1
    np.testing.assert_allclose(errors[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(errors[2, 1], -0.05 * scales, atol=1e-12)
    assert_uniform(scales, 0.02)


@pytest.mark.slow
def test_samples_are_lost_at_their_rate_and_the_others_are_as_ever():
    ticks, lanes = 3000, 8
    late = {**EXACT, "position_latency": 0.004}
    lossy, whole = (watch(board(**{**late, "position_dropout": rate}), ticks, lanes, swing) for rate in (0.05, 0.0))
    arrived = np.diff(lossy["position_time"], axis=0) > 0
    total = arrived[10:].size
    assert 1 - arrived[10:].mean() == pytest.approx(0.05, abs=4.5 * math.sqrt(0.05 * 0.95 / total))
    fresh = np.concatenate([np.zeros((1, lanes), bool), arrived])
    for axis in range(2):
        np.testing.assert_array_equal(lossy["position"][:, axis][fresh], whole["position"][:, axis][fresh])
    assert not np.array_equal(arrived[:, 0], arrived[:, 1])


def test_pressure_cells_have_a_bias_of_their_own():
    seen = watch(board(**{**EXACT, "pressure_bias": 5000.0}), 5, 600)["pressures"] - 3e5
    np.testing.assert_array_equal(seen, np.broadcast_to(seen[:1], seen.shape))
    assert_uniform(seen[0].ravel(), 5000.0)
    assert np.abs(np.corrcoef(seen[0]) - np.eye(4)).max() < 5 / math.sqrt(600)


def test_in_a_missed_period_everything_shown_stays():
    seen = watch(board(**{**EXACT, "missed_periods": 0.1}), 3000, 4, swing, pull)
    missed, *others = (
        (np.diff(seen[name].reshape(3000, -1, 4), axis=0) == 0).all(axis=1)
        for name in ("position_time", "position", "user_force")
    )
    assert missed.mean() == pytest.approx(0.1, abs=4.5 * math.sqrt(0.09 / missed.size))
    np.testing.assert_array_equal(others, [missed, missed])


def test_switching_one_error_off_leaves_the_draws_of_the_others():
    without = {"position_distortion": 0.0, "pressure_bias": 0.0}
    full, less = (watch(board(**changes), 300, 3, swing, pull) for changes in ({}, without))
    np.testing.assert_array_equal(full["user_force"], less["user_force"])
    assert not np.array_equal(full["position"], less["position"])
    assert not np.array_equal(full["pressures"], less["pressures"])


def test_ranges_are_drawn_for_every_episode_and_the_latest_arrives():
    ranges = {"electronics.force_latency": (0.0, 0.02), "electronics.position_latency": (0.0, 0.03)}
    seen = watch(board(**EXACT), 200, 40, lambda t: (0.5, 0.1 * t, 0, 0.1), lambda t: (100 * t, 0), ranges=ranges)
    late = 0.199 - seen["user_force"][-1, 0] / 100
    assert 0 <= late.min() < 0.003 < 0.017 < late.max() <= 0.02
    old = 0.199 - seen["position"][-1, 1] / 0.1
    assert 0 <= old.min() < 0.005 < 0.025 < old.max() <= 0.031
    # The board knows of no latency here, and stamps samples with the instant at which they arrive.
    assert (0.199 - seen["position_time"][-1]).max() < 0.001 + 1e-9
    assert abs(np.corrcoef(late, old)[0, 1]) < 0.6
